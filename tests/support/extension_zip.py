"""Building the extension's zip in tests."""

import os
import platform
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
PLATFORM = (f"{ {'Darwin': 'macos'}.get(platform.system(), platform.system().lower()) }-"
            f"{'arm64' if platform.machine().lower() in ('arm64', 'aarch64') else 'x64'}")
# Without an index, pip must give up at once; a proxy or a configuration must not help it.
OFFLINE = {"PIP_INDEX_URL": "http://127.0.0.1:1/simple", "PIP_CONFIG_FILE": os.devnull, "PIP_RETRIES": "0", "PIP_FIND_LINKS": "",
           "PIP_EXTRA_INDEX_URL": "", "http_proxy": "", "https_proxy": "", "no_proxy": "*"}


def build_extension(*arguments, environment=None):
    """The finished process of tools/build_extension.py."""
    command = [sys.executable, REPOSITORY / "tools/build_extension.py", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **(environment or {})})
