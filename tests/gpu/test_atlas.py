"""The light atlas in the preview against its numpy, and when other light is shown than its own."""

from dataclasses import replace

import numpy as np
import pytest
from atlas_scenes import cut_floor
from effect_frames import drawn_frame
from offset_technique import constant_grid
from picture_stage import view
from scene_builders import volume

from rtgi_addon.effects.atlas.bake import bake_atlas
from rtgi_addon.effects.atlas.relight import STALE_ATLAS
from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.effects.lit import indirect_irradiance, light_context
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.techniques.transfer import TECHNIQUE
from rtgi_addon.techniques.transfer.settings import TransferSettings

FEW, SIZE = AtlasSettings(rays=16, density=4.0, suns=3), (40, 26)


@pytest.fixture(scope="module")
def floor():
    """The cut floor, and probes of another light with its atlas."""
    scene, field = cut_floor(), ProbeField([constant_grid(volume(), 0.3)])
    field.atlas = bake_atlas(scene, None, FEW).atlas
    return scene, field


def shown(scene, field, seen=None):
    from rtgi_addon.preview.renderer import PreviewRenderer
    result, seen = PreviewRenderer(scene, field, None, ("combined",)), seen or view((0.0, -3.0, 2.0))
    result.frame(seen, SIZE)
    return result, drawn_frame(result, result.image("combined"), seen)


@pytest.mark.parametrize("height", [2.0, -2.0])
def test_both_halves_light_the_same(gpu_device, floor, height):
    scene, field = floor
    result, frame = shown(scene, field, view((0.0, -3.0, height)))
    found, expected = frame.irradiance[frame.gbuffer.seen][:, :3], indirect_irradiance(frame.context, field, frame.gbuffer)
    assert not result.notes and np.abs(found - expected).max() < 1e-4 * expected.max()
    assert (np.ptp(expected) > 0.2) == (height > 0)


def test_other_lamps_show_the_field_s_light(gpu_device, floor):
    scene, field = floor
    result, _ = shown(scene, field)
    result.update(replace(scene, lights=(replace(scene.lights[0], intensity=scene.lights[0].intensity * 2),)))
    result.frame(view((0.0, -3.0, 2.0)), SIZE)
    assert STALE_ATLAS in result.notes
    result.update(replace(scene, lights=scene.lights))
    assert STALE_ATLAS not in result.notes


def test_texels_stay_behind_where_live_voxels_follow_what_moves(gpu_device, floor):
    from rtgi_addon.techniques import get
    scene = floor[0]
    voxels = get("cone_tracing")
    settings = voxels.Settings(resolution=16, cones=6, light="voxels")
    field = voxels.bake(scene, settings, np.random.default_rng(0), Progress())
    field.atlas = floor[1].atlas
    result, _ = shown(scene, field)
    assert STALE_ATLAS not in result.notes
    apart = np.array(scene.instances[-1].world_from_local)
    apart[0, 3] += 0.2
    result.update(replace(scene, instances=(*scene.instances[:-1], replace(scene.instances[-1], world_from_local=apart))))
    assert STALE_ATLAS in result.notes
    result.close()


def test_texels_follow_the_light_of_transfer(gpu_device):
    from rtgi_addon.effects.atlas.relight import with_atlas
    scene = cut_floor()
    quick = TransferSettings(rays=64, sun_side=3, sites=0, cache_rays=32)
    field = TECHNIQUE.bake(scene, quick, np.random.default_rng(0), Progress())
    field.atlas = bake_atlas(scene, field, FEW).atlas
    result, _ = shown(scene, field)
    dimmed = replace(scene, lights=(replace(scene.lights[0], intensity=scene.lights[0].intensity * 0.25),))
    result.update(dimmed)
    while result.busy:
        result.take_light()
    result.frame(view((0.0, -3.0, 2.0)), SIZE)
    frame = drawn_frame(result, result.image("combined"), view((0.0, -3.0, 2.0)))
    expected = indirect_irradiance(light_context(dimmed), with_atlas(field.relight(dimmed), field, dimmed), frame.gbuffer)
    on_floor = frame.gbuffer.instance[frame.gbuffer.seen] == 0
    found = frame.irradiance[frame.gbuffer.seen][:, :3]
    assert not result.notes and not result.error
    assert np.abs(found - expected)[on_floor].max() < 1e-4 * expected.max() and np.ptp(expected[on_floor]) > 0.03
    result.close()
