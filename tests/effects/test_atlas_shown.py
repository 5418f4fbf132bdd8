"""A light atlas on the surfaces of pictures: where they read it, and whose light they show instead."""

from dataclasses import replace

import numpy as np
import pytest
from atlas_scenes import cut_floor, room
from offset_technique import constant_grid
from picture_stage import view
from scene_builders import transform, volume

from rtgi_addon.effects.atlas.bake import bake_atlas
from rtgi_addon.effects.atlas.relight import is_left_out, with_atlas
from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.effects.atlas.surfaces import surfaces_in
from rtgi_addon.effects.atlas.unwrapped import texture_space
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.scene import SunLight
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.transport.surfaces.geometry import flatten

FEW = AtlasSettings(rays=16)


@pytest.fixture(scope="module")
def floor():
    """The cut floor, turned and mirrored, and its atlas."""
    scene = cut_floor()
    turned = transform((0.3, -0.2, 0.1), (1.0, -1.2, 1.0), np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]))
    scene = replace(scene, instances=(replace(scene.instances[0], world_from_local=turned), *scene.instances[1:]))
    return scene, bake_atlas(scene, None, FEW).atlas


def field_with(atlas):
    field = ProbeField([constant_grid(volume(), 0.3)])
    field.atlas = atlas
    return field


def test_points_find_their_places_on_the_sheet(floor):
    scene, atlas = floor
    geometry, rng = flatten(scene), np.random.default_rng(0)
    primitive = rng.integers(geometry.count, size=500).astype(np.int32)
    u, v = rng.dirichlet((1, 1, 1), 500)[:, :2].T.astype(np.float32)
    points = geometry.points(primitive, u, v)
    seen_from_behind = rng.random(500) < 0.2
    faces = geometry.normals_world[primitive] * np.where(seen_from_behind, -1, 1)[:, None]
    rows, places = surfaces_in(scene, atlas).find(primitive, geometry.instance[primitive], points, faces)
    part = atlas.part("floor")
    corners = texture_space(scene.meshes[0].uv_layers[part.uv_map]) * part.scale + part.offset
    assert np.array_equal(rows, np.flatnonzero((geometry.instance[primitive] == 0) & ~seen_from_behind))
    weight = np.stack([1 - u - v, u, v], axis=1)[rows]
    assert np.abs(places - np.einsum("nk,nkc->nc", weight, corners[primitive[rows]])).max() < 1e-4


def test_pictures_show_texels_in_front_and_probes_elsewhere(floor):
    scene, atlas = floor
    seen = view((0.0, -3.0, 2.0))
    frame, plain = (draw_frame(scene, field_with(shown), seen, (24, 16)) for shown in (atlas, None))
    on_floor = frame.gbuffer.seen & (frame.gbuffer.instance == 0)
    assert 20 < on_floor.sum() < frame.gbuffer.seen.sum()
    assert np.array_equal(frame.irradiance[~on_floor], plain.irradiance[~on_floor])
    assert np.ptp(plain.irradiance[on_floor][:, 0]) < 1e-5 < 0.1 < np.ptp(frame.irradiance[on_floor][:, 0])
    # From below the backs of its faces are seen.
    below = draw_frame(scene, field_with(atlas), view((0.0, -3.0, -2.0)), (24, 16))
    on_floor = below.gbuffer.seen & (below.gbuffer.instance == 0)
    assert on_floor.sum() > 20 and np.ptp(below.irradiance[on_floor][:, 0]) < 1e-5


def test_only_what_has_the_name_and_the_map_reads_it(floor):
    scene, atlas = floor
    renamed = replace(scene, instances=(replace(scene.instances[0], name="other"), *scene.instances[1:]))
    assert surfaces_in(renamed, atlas) is None
    bare = replace(scene, meshes=(replace(scene.meshes[0], uv_layers={}, active_uv=None), *scene.meshes[1:]))
    assert surfaces_in(bare, atlas) is None
    twice = replace(scene, instances=(*scene.instances, scene.instances[0]))
    assert surfaces_in(twice, atlas) is None
    assert surfaces_in(scene, bake_atlas(room(), None, FEW).atlas) is None


def test_other_light_leaves_it_out_where_texels_do_not_follow(floor):
    scene, atlas = floor
    baked, lit = field_with(atlas), field_with(None)
    sunny = replace(scene, lights=(*scene.lights, SunLight("sun", np.array([0.0, 0.0, -1.0]), np.ones(3, np.float32))))
    assert with_atlas(lit, baked, sunny).atlas is None and is_left_out(lit, baked)
    assert not is_left_out(baked, baked) and not is_left_out(lit, lit)
