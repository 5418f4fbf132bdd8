"""How the library is built: from pinned things, into the bytes that are written down, and with every index checked."""

import ctypes
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def tool():
    """tools/build_kernels.py as a module."""
    sys.path.insert(0, str(ROOT / "tools"))
    try:
        import build_kernels
        return build_kernels
    finally:
        sys.path.remove(str(ROOT / "tools"))


def test_what_is_pinned_is_of_these_sources(tool):
    """Where this fails: `python tools/build_kernels.py --pin`."""
    known = tool.pins()
    assert known["sources"] == tool.sources_digest()
    assert set(known) == {"sources", *(tool.wheel_name(target) for target in tool.PLATFORMS)}


def test_versions_are_the_same_in_c_and_python(tool):
    from rtgi_addon.kernels import library
    assert tool.version() == f"{library.VERSION}.0"


def test_a_wheel_has_the_same_bytes_every_time(tool, tmp_path):
    one, other = tmp_path / "one.whl", tmp_path / "other.whl"
    for path in (one, other):
        tool.pack("linux-x64", b"library", "rtgi_kernels.so", path)
    assert one.read_bytes() == other.read_bytes()
    with zipfile.ZipFile(one) as archive:
        assert archive.testzip() is None
        assert archive.read("rtgi_kernels/rtgi_kernels.so") == b"library"


@pytest.mark.slow
def test_the_host_is_built_as_pinned(tool, tmp_path):
    if not (Path(sys.prefix) / "zig").is_dir():
        pytest.skip("the compiler of the kernels is not there")
    target = tool.host()
    path = tool.wheel(target, tmp_path)
    assert tool.sha256(path) == tool.pins()[path.name]
    with zipfile.ZipFile(path) as archive:
        name, = [name for name in archive.namelist() if name.endswith(f".{tool.PLATFORMS[target][2]}")]
        library = ctypes.CDLL(archive.extract(name, tmp_path))
    assert library.rtgi_version() == int(tool.version().split(".")[0]) and library.rtgi_is_checked() == 0


@pytest.mark.slow
def test_no_index_is_outside_under_sanitizers(tool, tmp_path):
    """The comparison with numpy again, in a build that ends the process at the first access outside an array."""
    if not shutil.which("cc") or sys.platform != "linux":
        pytest.skip("a debug build takes a C compiler on Linux")
    library = tmp_path / "checked.so"
    try:
        tool.checked_library(library)
    except tool.KernelError as error:
        pytest.skip(str(error))
    found = [subprocess.run(["cc", f"-print-file-name={name}"], capture_output=True, text=True, check=True).stdout.strip()
             for name in ("libasan.so", "libubsan.so")]
    environment = {**os.environ, "RTGI_KERNELS": str(library), "LD_PRELOAD": " ".join(found), "ASAN_OPTIONS": "detect_leaks=0"}
    files = [str(ROOT / f"tests/kernels/test_{name}.py") for name in ("kernels", "texel_kernels")]
    ran = subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", "-rs", *files],
                         cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout[-3000:] + ran.stderr[-3000:]
    assert "no compiled kernels" not in ran.stdout
