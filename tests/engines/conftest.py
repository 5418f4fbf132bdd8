"""What tests of exports need beside Python: Node with three from npm, Chromium, and a server for pages."""

import functools
import http.server
import json
import shutil
import subprocess
import threading
from pathlib import Path

import pytest

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines.kit import kit_field

PACKAGES = Path(__file__).parent / "threejs"


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture(scope="session")
def node():
    """The command of Node 20 or later."""
    found = shutil.which("node")
    if found is None:
        pytest.skip("needs Node.js 20 or later: `node` is not installed")
    version = subprocess.run([found, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    if int(version.lstrip("v").split(".")[0]) < 20:
        pytest.skip(f"needs Node.js 20 or later: this is {version}")
    return found


@pytest.fixture(scope="session")
def node_modules(node):
    """The folder of npm's packages, filled on the first run."""
    folder = PACKAGES / "node_modules"
    if not (folder / ".package-lock.json").is_file():
        npm = shutil.which("npm")
        if npm is None:
            pytest.skip("needs three.js: `npm` is not installed")
        ran = subprocess.run([npm, "ci", "--no-audit", "--no-fund"], cwd=PACKAGES, capture_output=True, text=True, timeout=300,
                             check=False)
        if ran.returncode:
            pytest.skip(f"needs three.js: `npm ci` in tests/engines/threejs failed: {ran.stderr.strip().splitlines()[-1:]}")
    return folder


@pytest.fixture(scope="session")
def chromium():
    """The command of Chromium."""
    found = shutil.which("chromium")
    if found is None:
        pytest.skip("needs Chromium: `chromium` is not installed")
    return found


@pytest.fixture(scope="session")
def install_three(node_modules):
    """Put a release of three, "three" or "three-oldest", into an export, as `npm install` would."""
    def install(folder: Path, release: str = "three") -> Path:
        (folder / "node_modules").mkdir(exist_ok=True)
        (folder / "node_modules" / "three").symlink_to(node_modules / release, target_is_directory=True)
        return folder
    return install


@pytest.fixture(scope="session")
def kit_bundle():
    """A bundle that holds the conformance kit itself."""
    return Bundle(Path("kit"), {"scene": "kit", "includes_direct": False}, kit_field().grids())


@pytest.fixture
def export(kit_bundle, tmp_path):
    """The kit exported to three.js."""
    return engines.get("threejs").export(kit_bundle, tmp_path / "export").out


@pytest.fixture
def browse(node, node_modules, chromium, tmp_path):
    """Open a file of a folder in Chromium: what browser.mjs reports."""
    servers = []

    def open_page(folder: Path, name: str, width: int = 480, height: int = 480, **job) -> dict:
        handler = functools.partial(_Quiet, directory=folder)
        servers.append(http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler))
        threading.Thread(target=servers[-1].serve_forever, daemon=True).start()
        job = {"url": f"http://127.0.0.1:{servers[-1].server_port}/{name}", "width": width, "height": height, **job}
        command = [node, PACKAGES / "browser.mjs", chromium, tmp_path / f"profile{len(servers)}", json.dumps(job)]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return json.loads(ran.stdout)

    yield open_page
    for server in servers:
        server.shutdown()
        server.server_close()
