"""What a bake of probes is thought to take beside what it took, and what is said where that is too much."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from room_scenes import textured_room
from scene_builders import closed_box

from rtgi_addon.errors import BakeError
from rtgi_addon.progress import Progress
from rtgi_addon.scene import memory
from rtgi_addon.techniques import get
from rtgi_addon.techniques.base import Checkpoint
from rtgi_addon.techniques.probes.bake import BATCH_RAYS, MAX_KEPT_RAYS, ProbeBake, surface_cache
from rtgi_addon.techniques.probes.captured import lamp_light_of
from rtgi_addon.techniques.probes.memory import RayBytes, expected_rays, largest_round, working_bytes
from rtgi_addon.techniques.probes.reach import Reach
from rtgi_addon.techniques.probes.settings import ProbeSettings
from rtgi_addon.transport.cache.memory import kept_bytes, traced_bytes
from rtgi_addon.transport.context import LightContext

ROOT = Path(__file__).resolve().parents[3]
MEASURE = """
import sys
sys.path[:0] = [{root!r}, {root!r} + "/tests/support"]
import numpy as np
from scene_builders import closed_box
from rtgi_addon.progress import Progress
from rtgi_addon.scene.memory import estimate_bytes
from rtgi_addon.techniques import get
from rtgi_addon.techniques.base import Checkpoint
from rtgi_addon.techniques.probes.bake import BATCH_RAYS, MAX_KEPT_RAYS, ProbeBake, surface_cache
from rtgi_addon.techniques.probes.memory import working_bytes
from rtgi_addon.techniques.probes.reach import reach_of
from rtgi_addon.transport.context import LightContext

def resident(name):
    return int(open("/proc/self/status").read().split(name + ":")[1].split()[0]) * 1024

np.random.default_rng(0).random(3)
technique, scene = get("probes"), closed_box(resolution=(4, 4, 4))
settings = technique.Settings(rays=64, cache_rays=256)
before = resident("VmRSS")
open("/proc/self/clear_refs", "w").write("5")
technique.bake(scene, settings, np.random.default_rng(0), Progress(), threads=2)
peak = resident("VmHWM") - before
context = LightContext(scene, 2)
cache, centre = surface_cache(context, scene.volumes, settings, 0), np.zeros((1, 3), np.float32)
reach = reach_of(context, cache.layout, centre, 0)
needs = estimate_bytes(scene, 2) | working_bytes(cache, settings, reach, 64, BATCH_RAYS, MAX_KEPT_RAYS)
print(peak, sum(needs.values()))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux lets the peak be reset")
def test_the_estimate_is_near_what_was_measured():
    done = subprocess.run([sys.executable, "-c", MEASURE.format(root=str(ROOT))], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    peak, estimate = map(int, done.stdout.split())
    assert 2**25 < peak and 0.8 * peak < estimate < 1.6 * peak


@pytest.mark.parametrize("free", [5 << 20, 30 << 20])
def test_too_little_is_said_before_it_is_taken(monkeypatch, free):
    technique = get("probes")
    monkeypatch.setattr(memory, "available_bytes", lambda: free)
    with pytest.raises(BakeError, match=r"needs about .* MiB of memory, most of it for the surface cache") as caught:
        technique.bake(closed_box(), technique.Settings(error=0.005), np.random.default_rng(0), Progress(), threads=1)
    assert "allow a larger error" in caught.value.remedy


def test_every_batch_is_checked_for_what_it_takes(monkeypatch):
    """Enough for what was expected, and gone once the rays are on their way."""
    technique, asked = get("probes"), []

    def available():
        asked.append(None)
        return None if len(asked) < 3 else 1

    monkeypatch.setattr(memory, "available_bytes", available)
    with pytest.raises(BakeError, match="the bake needs about"):
        technique.bake(closed_box(), technique.Settings(rays=64), np.random.default_rng(0), Progress(), threads=1)
    assert len(asked) == 3


def test_a_lower_error_takes_more_rays():
    assert expected_rays(ProbeSettings(rays=100)) == 100
    assert expected_rays(ProbeSettings(error=0.1)) < expected_rays(ProbeSettings()) < expected_rays(ProbeSettings(error=0.003))
    assert expected_rays(ProbeSettings(error=0.001)) == ProbeSettings().max_rays


def test_what_is_not_there_together_is_not_added_up():
    """Texels are traced by the first rays and kept beside the last: many texels make the one moment the larger, many rays the
    other."""
    scene, settings = closed_box(), ProbeSettings()
    cache = surface_cache(LightContext(scene, 1), scene.volumes, settings, 0)
    layout = working_bytes(cache, settings, Reach(0, 1.0), 0, BATCH_RAYS, MAX_KEPT_RAYS)["the surface cache"]
    few, many = (working_bytes(cache, settings, Reach(20000, 1.0), probes, BATCH_RAYS, MAX_KEPT_RAYS) for probes in (10, 4000))
    assert few["the surface cache"] - layout == traced_bytes(cache, 20000)
    assert many["the surface cache"] - layout == kept_bytes(cache, 20000) < 0.5 * traced_bytes(cache, 20000)
    assert many["rays"] > 100 * few["rays"] and sum(many.values()) > sum(few.values())


def test_what_varies_within_triangles_is_kept_with_the_rays():
    """What a bake keeps of each ray is what was counted for it, give or take a share of a direction."""
    settings = ProbeSettings(rays=512, texel_size=0.3)
    for scene in (closed_box(), textured_room()):
        bake = ProbeBake(LightContext(scene, 1), scene.volumes, settings, 0, Progress(), Checkpoint(), "bake",
                         lamp_light_of(LightContext(scene, 1), scene.volumes[0], settings, 0))
        bake.run()
        kept = sum(array.nbytes for item in bake.memory.items for array in (item.directions, item.texel, item.escaped, item.albedo)
                   if array is not None)
        assert abs(kept / bake.ray_count - RayBytes.of(bake.context).kept) < 2.0


def test_the_largest_round_is_that_of_the_doublings():
    assert largest_round(np.array([512, 512]), np.array([2048, 700])) == 1024
    assert largest_round(np.array([512, 512]), np.array([600, 1000])) == 88 + 488
    assert largest_round(np.array([512]), np.array([100])) == 0


def test_what_takes_most_says_what_to_do():
    for name in ("geometry", "textures", "probes", "the surface cache", "rays", "threads", "shadow maps",
                 "virtual lights", "cells"):
        problem, remedy = memory.shortage({name: 3 << 30, "rays" if name != "rays" else "probes": 1 << 20}, 1 << 30)
        assert f"most of it for {name} (3.0 GiB); 1.0 GiB are free" in problem and remedy
    assert memory.shortage({"rays": 5}, None) is None and memory.shortage({"rays": 5}, 5) is None
