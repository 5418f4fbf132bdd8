"""What bakes of every technique are thought to take beside what they took, and what is said where that is too much."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scene_builders import closed_box

from rtgi_addon.errors import BakeError
from rtgi_addon.progress import Progress
from rtgi_addon.scene import memory
from rtgi_addon.techniques import get

ROOT = Path(__file__).resolve().parents[2]
# Settings at which what is measured is much more than a program and its threads.
LARGE = {"rsm": {"resolution": 1024}, "vpl": {"lights": 16384}, "lpv": {"map_resolution": 256, "resolution": 32, "steps": 8},
         "voxel_march": {"resolution": 96, "light": "voxels", "bounces": 1, "rays": 8}}
MEASURE = """
import sys
sys.path[:0] = [{root!r}, {root!r} + "/tests/support", {root!r} + "/benchmarks"]
import memory
from scene_builders import closed_box
found = memory.measure(closed_box(resolution=(4, 4, 4)), {name!r}, {settings!r}, 2)
print(found["estimate"], found["peak"])
"""


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux lets the peak be reset")
@pytest.mark.parametrize("name", LARGE)
def test_the_estimate_is_near_what_was_measured(name):
    code = MEASURE.format(root=str(ROOT), name=name, settings=LARGE[name])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    estimate, peak = map(int, done.stdout.split())
    assert peak > 50 << 20 and 0.9 * peak < estimate < 1.5 * peak


@pytest.mark.parametrize(("name", "word", "remedy"), [
    ("rsm", "shadow maps", "resolution of the lamps' maps"), ("lpv", "shadow maps", "resolution of the lamps' maps"),
    ("vpl", "virtual lights", "number of virtual lights"), ("voxel_march", "voxels", "use fewer cascades")])
def test_too_little_is_said_before_it_is_taken(monkeypatch, name, word, remedy):
    monkeypatch.setattr(memory, "available_bytes", lambda: 12 << 20)
    technique = get(name)
    with pytest.raises(BakeError, match=f"needs about .* of memory, most of it for {word}") as caught:
        technique.bake(closed_box(), technique.Settings(**LARGE[name]), np.random.default_rng(0), Progress(), threads=1)
    assert remedy in caught.value.remedy
