"""The light atlas: rooms whose light is known, seams, what will not do, and how it is read."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from atlas_scenes import cube_map, cut_floor, in_atlas, room

from rtgi_addon.effects.atlas.bake import bake_atlas, require_atlas
from rtgi_addon.effects.atlas.borders import dilated, joined, seams_of
from rtgi_addon.effects.atlas.coefficients import exact_for, irradiance_weights, projected
from rtgi_addon.effects.atlas.fit import LookUpMeans, fitted
from rtgi_addon.effects.atlas.islands import bleeding
from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.effects.atlas.sheet import bilinear
from rtgi_addon.effects.atlas.unwrapped import Part, Sheet, lay_out, places_of, texture_space
from rtgi_addon.errors import BakeError
from rtgi_addon.evaluate.metrics import relative_rmse
from rtgi_addon.evaluate.receivers import Receivers
from rtgi_addon.evaluate.references import PathReference
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene.scene import DYNAMIC
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.surfaces.geometry import flatten

FEW = AtlasSettings(rays=64)


@pytest.fixture(scope="module")
def floor():
    return cut_floor(), bake_atlas(cut_floor(), None, AtlasSettings(density=12.0)).atlas


def test_every_texel_of_a_furnace_receives_the_same():
    """Radiance e/(1 − ρ) from everywhere is π times that of irradiance, and all of its SH is in what the half space shows."""
    atlas = bake_atlas(room(build.cube_furnace(0.5, 1.0)), None, FEW).atlas
    assert np.abs(atlas.irradiance[atlas.known] / (2.0 * np.pi) - 1.0).max() < 1e-4
    assert atlas.known.sum() > 1000 and atlas.irradiance[:40, :60].min() > 6.2


def test_directions_of_an_open_floor():
    """Under a uniform sky of radiance 1 a plane's coefficients are those of the half space, moved to E = π."""
    built = in_atlas(build.open_plane(world=1.0, half_size=1.0), 0, [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    atlas = bake_atlas(built, None, AtlasSettings(rays=1024)).atlas
    light = atlas.coefficients[8, 8, :, 0]
    assert abs(light[0] - 2 * np.pi * 0.282095) < 0.04 and abs(light[2] - np.pi * 0.488603) < 0.04
    assert np.abs(light[[1, 3]]).max() < 0.02
    assert abs(atlas.read(np.array([[8.5, 8.5]]), np.array([[0.0, 0.0, 1.0]]))[0, 0] - np.pi) < 1e-5


def test_coefficients_are_exact_for_the_texel_s_normal_and_change_the_least():
    rng = np.random.default_rng(3)
    coefficients, irradiance = rng.normal(size=(5, 4, 3)), rng.random((5, 3))
    normals = rng.normal(size=(5, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    found, weights = exact_for(coefficients, normals, irradiance), irradiance_weights(normals)
    assert np.allclose(np.einsum("nk,nkc->nc", weights, found), irradiance)
    change = found - coefficients
    along = np.einsum("nk,nkc->nc", weights, change) / np.sum(weights**2, axis=1)[:, None]
    assert np.allclose(change, weights[:, :, None] * along[:, None])


def test_projection_of_all_directions_is_their_radiance():
    directions = fibonacci_sphere(4096).astype(np.float32)
    cosine = np.abs(directions[:, 2])
    light = np.full((4096, 3), 4 * np.pi / 4096, np.float32) * np.maximum(cosine, 0.02)[:, None]
    assert np.allclose(projected(directions, light, cosine).sum(axis=0)[0], 4 * np.pi * 0.282095, rtol=1e-3)


@pytest.mark.slow
def test_surfaces_are_as_the_path_tracer_has_them():
    built = room(build.closed_box(0.6, 2.0, light_position=(0.3, 0.2, 0.1)))
    atlas, context = bake_atlas(built, None, AtlasSettings()).atlas, LightContext(built)
    rng, part = np.random.default_rng(4), atlas.sheet.parts[0]
    triangle = rng.integers(12, size=200).astype(np.int32)
    u, v = rng.random((2, 200)).astype(np.float32)
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    corners = texture_space(built.meshes[0].uv_layers["Lightmap"])[triangle]
    shares = np.stack([1 - u - v, u, v], axis=1).astype(np.float64)
    places = np.einsum("ni,nic->nc", shares, corners) * part.scale + part.offset
    receivers = Receivers(context.geometry.points(triangle, u, v), context.geometry.normals_world[triangle], np.ones(200, bool))
    truth = PathReference(context, 0.01).irradiance(receivers)
    assert relative_rmse(atlas.read(places, receivers.normals), truth.mean, truth.variance) < 0.03


def test_threads_change_nothing():
    one, two = (bake_atlas(room(), None, FEW, seed=5, threads=threads).atlas for threads in (1, 2))
    assert np.array_equal(one.coefficients, two.coefficients)


def test_seams_step_no_more_than_twice_what_is_inside(floor):
    built, atlas = floor
    here, there = seams_of(atlas.sheet.parts[0], built)
    across = np.abs(bilinear(atlas.irradiance, here) - bilinear(atlas.irradiance, there)).max()
    rng, size = np.random.default_rng(1), atlas.sheet.size
    places, half = rng.random((4000, 2)) * (size[1], size[0]), np.array([0.5, 0.0])
    inside = np.all([bilinear(atlas.known.astype(float), places + way * 2 * half) > 0.999 for way in (-1, 1)], axis=0)
    within = np.abs(bilinear(atlas.irradiance, places[inside] + half) - bilinear(atlas.irradiance, places[inside] - half)).max()
    assert len(here) > 50 and across <= 2.0 * within


def test_joining_is_what_closes_seams(floor):
    built, atlas = floor
    here, there = seams_of(atlas.sheet.parts[0], built)
    rough = atlas.irradiance + np.random.default_rng(2).normal(0, 0.2, atlas.irradiance.shape)
    gaps = [np.abs(bilinear(image, here) - bilinear(image, there)).mean()
            for image in (rough, joined(rough, atlas.known, here, there))]
    assert gaps[1] < 0.2 * gaps[0]


def test_the_sheet_holds_every_place_once(floor):
    built, _ = floor
    geometry = flatten(built)
    sheet = lay_out(built, geometry, AtlasSettings(density=12.0))
    places = places_of(sheet.parts[0], sheet, built, geometry)
    assert abs(len(places.texel) / 16 / 12.0**2 / 8.0 - 1.0) < 0.02
    points = geometry.points(places.triangle, places.u, places.v)
    st = np.stack([places.texel % sheet.size[1], places.texel // sheet.size[1]], axis=1)
    row = np.flatnonzero(np.all(st == st[0], axis=1))
    assert len(row) <= 16 and np.linalg.norm(np.ptp(points[row], axis=0)) < 1.5 / 12.0


def test_what_lies_under_a_solid_is_filled_from_beside_it():
    block = build.cube("block", 0.4)
    block = replace(block, vertices_local=block.vertices_local + np.array([0.0, 0.0, 0.4], np.float32))
    built = build.scene([build.plane("floor", 1.0), block], world=1.0)
    built = in_atlas(built, 0, [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    atlas = bake_atlas(built, None, FEW).atlas
    assert not atlas.known[10, 10] and atlas.irradiance[10, 10].min() > 0.5


@pytest.mark.parametrize(("change", "said"), [
    (lambda built: in_atlas(built), "room has no UV map"),
    (lambda built: in_atlas(built, 0, np.zeros((12, 3, 2))), "'Lightmap' of room gives no area"),
    (lambda built: in_atlas(built, 0, cube_map(built) % (1 / 3)), "'Lightmap' of room overlaps itself on"),
    (lambda built: in_atlas(built, 0, np.full((12, 3, 2), np.nan)), "'Lightmap' of room holds values that are not finite"),
], ids=["none", "flat", "overlaps", "nan"])
def test_maps_that_will_not_do_are_refused_by_name(change, said):
    with pytest.raises(BakeError, match=said):
        require_atlas(change(build.closed_box()), FEW)


def test_a_wanted_map_that_is_not_there_is_named():
    built = room()
    built = replace(built, instances=(replace(built.instances[0], atlas="Other"),))
    with pytest.raises(BakeError, match=r"room has no UV map 'Other': choose one of Lightmap"):
        require_atlas(built, FEW)


def test_an_atlas_that_fits_no_texture_is_refused_with_the_largest():
    with pytest.raises(BakeError, match=r"of them for room, and 64 along a side is the most.*atlas\.density"):
        require_atlas(room(), AtlasSettings(density=40.0, largest=64))


def test_what_moves_or_is_placed_often_is_refused():
    built = room()
    with pytest.raises(BakeError, match="room is Dynamic"):
        require_atlas(replace(built, instances=(replace(built.instances[0], bake=DYNAMIC),)), FEW)
    with pytest.raises(BakeError, match="room is placed 2 times"):
        require_atlas(replace(built, instances=built.instances * 2), FEW)


def test_fronts_that_face_into_solids_are_told():
    built = build.scene([build.plane("floor", 0.5, z=0.5), build.cube("block", 1.0)], world=1.0)
    built = in_atlas(built, 0, [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    assert "turn its normals" in bake_atlas(built, None, FEW).notes[0]


def test_islands_that_read_each_other_are_told():
    built = room()
    assert not bake_atlas(built, None, FEW).notes
    near = in_atlas(built, 0, cube_map(built, gap=0.004))
    (note,) = bake_atlas(near, None, FEW).notes
    assert note.startswith("room reads light of other islands of its UV map Lightmap on ") and "two texels apart" in note
    sheet, geometry = lay_out(near, flatten(near), FEW), flatten(near)
    share = bleeding(sheet.parts[0], sheet, near, geometry, places_of(sheet.parts[0], sheet, near, geometry))
    # A border of half a texel about each face, but where no other is beside it.
    assert 0.02 < share < 4 * 0.75 / (2.0 * FEW.density)


def test_a_slope_across_little_more_than_a_texel_is_read_back():
    """An island that covers columns from 5 to 6.3 of a sheet, whose light grows with the column."""
    size, across = (12, 12), (np.arange(4) + 0.5) / 4
    covered, texels, values = np.ones((2, 10, 4, 4), bool), np.stack([np.arange(1, 11) * 12 + column for column in (5, 6)]), []
    covered[1] &= across < 0.3
    for column, part in zip((5, 6), covered, strict=True):
        values.append(np.full(10, np.broadcast_to(column + across, (4, 4))[part[0]].mean()))
    image, known = np.zeros((*size, 1), np.float32), np.zeros(size, bool)
    image.reshape(-1)[texels], known.reshape(-1)[texels] = values, True
    part = Part("strip", 0, "map", 0, 0, 0, 12, 12, 1.0, np.zeros(2))
    filled, _ = dilated(image, known, Sheet((part,), size))
    means = LookUpMeans(size, texels.reshape(-1), covered.reshape(-1, 16))
    places = np.stack([np.linspace(5.05, 6.25, 13), np.full(13, 6.0)], axis=1)
    before, after = (np.abs(bilinear(shown, places)[:, 0] - places[:, 0]).max() for shown in (filled, fitted(filled, means, known)))
    assert after < 0.55 * before
    # What is even stays so.
    even = np.ones_like(image)
    assert np.allclose(fitted(even, means, known), even, atol=1e-6)
    # And the transpose is one.
    rng = np.random.default_rng(6)
    one, other = rng.normal(size=(2, *size, 1))
    assert np.isclose(np.sum(means.of(one) * other), np.sum(one * means.back(other)))
