"""Run pytest inside a real Blender, whose exit code is then pytest's:

    blender -b --factory-startup --gpu-backend vulkan --python tests/support/run_in_blender.py -- tests/gpu

Needs pytest and embreex in Blender's Python, as in the tree that tools/debian_tree.py makes.
"""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    """Run what the command line names after `--`."""
    import pytest
    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT))
    return int(pytest.main(["-p", "no:cacheprovider", *sys.argv[sys.argv.index("--") + 1:]]))


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # Blender's own way out would replace the exit code.
    os._exit(code)
