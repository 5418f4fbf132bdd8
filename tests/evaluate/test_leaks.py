"""Leaks are found where light is that should not be, and blamed on what lets it through."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from probe_bakes import QUICK, bake

from rtgi_addon.evaluate.leaks import Cause, find_leaks, name_causes
from rtgi_addon.evaluate.receivers import Receivers
from rtgi_addon.evaluate.references import Truth
from rtgi_addon.progress import Progress
from rtgi_addon.techniques import get
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.techniques.lattice.lookup import LookupSettings
from rtgi_addon.transport.context import LightContext


def black_receivers(points, normals):
    """Receivers that should get nothing, among as many in the light that are right."""
    count = len(points)
    receivers = Receivers(np.float32(points), np.float32(normals), np.ones(count, bool))
    return receivers, Truth(np.zeros((count, 3)), np.zeros((count, 3)))


def all_seeing(field, dead=None):
    """The same probes, made to believe that they see for miles; those ``dead`` (nz, ny, nx) lie inside geometry."""
    grids = []
    for grid in field.grids():
        visibility = np.empty_like(grid.visibility)
        visibility[..., 0], visibility[..., 1] = 1e3, 1e6
        validity = grid.validity if dead is None else np.where(dead, 0.0, grid.validity).astype(np.float32)
        grids.append(replace(grid, visibility=visibility, validity=validity))
    return ProbeField(grids)


def dark_wall(thickness):
    """The dark side of the wall between two rooms: points and normals (n, 3)."""
    y, z = (part.ravel() for part in np.meshgrid(np.linspace(-0.5, 0.5, 4), np.linspace(-0.5, 0.5, 4)))
    return np.stack([np.full(16, 0.5 * thickness + 1e-4), y, z], axis=1), np.tile([1.0, 0.0, 0.0], (16, 1))


@pytest.fixture(scope="module")
def two_rooms():
    scene = rooms.two_rooms(thickness=0.1, resolution=(4, 2, 2))
    return LightContext(scene), bake(scene, **QUICK)


def causes(context, field, points, normals):
    receivers, truth = black_receivers(points, normals)
    found = field.irradiance(receivers.points, receivers.normals)
    assert found.min() > 0
    return set(name_causes(context, field, receivers, found.astype(float), truth).tolist())


def test_a_wall_between_receiver_and_probe(two_rooms):
    context, field = two_rooms
    assert causes(context, all_seeing(field), *dark_wall(0.1)) == {Cause.THIN_WALL}


def test_a_lookup_without_visibility(two_rooms):
    context, field = two_rooms
    blind = field.with_lookup(LookupSettings(visibility=False, normal_weight=False))
    assert causes(context, blind, *dark_wall(0.1)) == {Cause.NO_VISIBILITY}


def test_a_sheet_without_thickness():
    scene = rooms.two_rooms(thickness=0.0, resolution=(4, 2, 2))
    field = bake(scene, **QUICK)
    assert causes(LightContext(scene), all_seeing(field), *dark_wall(0.0)) == {Cause.TWO_SIDED}


def test_probes_inside_geometry(two_rooms):
    context, field = two_rooms
    dead = np.zeros(field.grids()[0].validity.shape, bool)
    dead[:, :, 1:3] = True
    assert causes(context, all_seeing(field, dead), *dark_wall(0.1)) == {Cause.INSIDE}


def test_what_is_right_is_no_leak(two_rooms):
    context, field = two_rooms
    receivers, _ = black_receivers(*dark_wall(0.1))
    found = np.full((16, 3), 2.0)
    assert not name_causes(context, field, receivers, found, Truth(np.full((16, 3), 1.9), np.zeros((16, 3)))).any()
    # Noise alone explains a difference of two of its standard deviations.
    noisy = Truth(np.full((16, 3), 1.0), np.full((16, 3), 0.25))
    assert not name_causes(context, field, receivers, found, noisy).any()


@pytest.mark.parametrize("name, settings, expected", [
    ("rsm", {"resolution": 64, "samples": 64}, Cause.NO_VISIBILITY),
    ("lpv", {"resolution": 8, "map_resolution": 64, "steps": 64}, Cause.THIN_WALL)])
def test_techniques_that_cannot_see_walls(name, settings, expected):
    scene = rooms.two_rooms(thickness=0.1, resolution=(8, 4, 4), half_size=(2.0, 1.0, 1.0))
    technique = get(name)
    field = technique.bake(scene, technique.Settings(**settings), np.random.default_rng(0), Progress())
    points, normals = dark_wall(0.1)
    if name == "rsm":
        # Light that shines through the wall is seen by what faces it.
        points[:, 0], normals = 2.04, -normals
    receivers, truth = black_receivers(points, normals)
    found = np.asarray(field.irradiance(receivers.points, receivers.normals), float)
    if name == "lpv":
        # Its walls let nothing through: what is too bright all the same is said to stand behind a thin one.
        assert not found.any()
        found[:] = 1.0
    named = name_causes(LightContext(scene), field, receivers, found, truth)
    assert set(named[named > 0].tolist()) == {expected}


def test_a_map_of_a_scene_counts_what_it_names(two_rooms):
    context, field = two_rooms
    blind = field.with_lookup(LookupSettings(visibility=False, normal_weight=False))
    seen, leaks = find_leaks(context, field, points=120), find_leaks(context, blind, points=120)
    assert len(leaks.cause) == 120 and leaks.error.shape == (120,) and leaks.radius > 0
    assert leaks.counts()[Cause.NO_VISIBILITY] > seen.counts().get(Cause.THIN_WALL, 0)
    assert sum(leaks.counts().values()) == np.count_nonzero(leaks.cause) > 0
    assert leaks.lines()[0].startswith(f"{np.count_nonzero(leaks.cause)} of 120")
    assert leaks.nearest(leaks.receivers.points[7]) == 7 and leaks.nearest(np.full(3, 1e3)) is None
    # Leaking receivers are brighter than they should be.
    assert np.all(leaks.error[leaks.cause > 0] > 0)


def test_a_closed_box_leaks_nowhere():
    scene = build.closed_box(albedo=0.5, resolution=(4, 4, 4), half_size=0.9)
    assert not {Cause.THIN_WALL, Cause.TWO_SIDED, Cause.NO_VISIBILITY} & set(
        find_leaks(LightContext(scene), bake(scene, error=0.05), points=60).counts())
