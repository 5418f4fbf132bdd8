"""How many texels a few rays say that all of them will reach, held to what bakes reach."""

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.progress import Progress
from rtgi_addon.techniques import get
from rtgi_addon.techniques.probes.bake import surface_cache
from rtgi_addon.techniques.probes.reach import reach_of
from rtgi_addon.transport.context import LightContext

# A room with a volume in it, and the same with another room of twice its side beside it, which no ray gets into.
ROOM = build.cube("room", 1.0, inward=True)
OTHER = rooms.moved(build.cube("other", 2.0, inward=True), (4.0, 0.0, 0.0))


def scene_of(*meshes):
    return build.scene(meshes, [build.material("wall", 0.5)], [build.point_light()], volumes=[build.volume(resolution=(3, 3, 3))])


@pytest.mark.parametrize("meshes", [(ROOM,), (ROOM, OTHER)])
def test_it_is_what_a_bake_reaches_and_nothing_out_of_sight(meshes):
    scene, technique = scene_of(*meshes), get("probes")
    settings = technique.Settings(rays=2048, texel_size=0.05)
    context = LightContext(scene, 1)
    layout = surface_cache(context, scene.volumes, settings, 0).layout
    found = reach_of(context, layout, np.zeros((1, 3), np.float32), 0).texels
    baked = technique.bake(scene, settings, np.random.default_rng(0), Progress(), threads=1).stats["texels"]
    assert 0.85 * baked < found < 1.15 * baked
    assert len(meshes) == 1 or found < 0.7 * layout.likely_texels


def test_it_is_the_same_for_any_number_of_threads_and_no_more_than_there_is():
    scene = scene_of(ROOM)
    context = LightContext(scene, 1)
    layout = surface_cache(context, scene.volumes, get("probes").Settings(texel_size=0.5), 0).layout
    centre = np.zeros((1, 3), np.float32)
    found = reach_of(context, layout, centre, 0)
    assert found == reach_of(LightContext(scene, 2), layout, centre, 0) and found.texels <= layout.likely_texels
    assert found.texels > 50 and found.hits == 1.0


def test_nothing_is_reached_from_nowhere_and_in_the_open():
    scene = scene_of(build.plane(half_size=1.0, z=-50.0))
    context = LightContext(scene, 1)
    layout = surface_cache(context, scene.volumes, get("probes").Settings(), 0).layout
    assert reach_of(context, layout, np.zeros((0, 3), np.float32), 0) == (0, 0.0)
    assert reach_of(context, layout, np.array([[0.0, 0.0, 1e6]], np.float32), 0) == (0, 0.0)
