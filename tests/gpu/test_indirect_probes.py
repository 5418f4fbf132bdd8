"""The irradiance function of probes on the GPU against ``ProbeField.irradiance``: relative to the largest irradiance."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from probe_bakes import QUICK, bake
from receivers import directions, error, points_in, relative_error, waited
from scattered_rooms import scattered, storeys

from rtgi_addon.scene import ProbeVolume
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.techniques.lattice.lookup import LookupSettings

# Float sums in another order; where a stored variance is what cancellation leaves, the share that is seen has fewer digits.
TYPICAL, WORST = 2e-6, 1e-4


@pytest.fixture(scope="module")
def indirect(gpu_device):
    from rtgi_addon.preview import indirect
    return indirect


def agrees(indirect, field, points, normals):
    found = relative_error(indirect.make_indirect(field, None), field, points, normals)
    return np.quantile(found, 0.99) < TYPICAL and found.max() < WORST


def receivers_in(half_size, count=3000):
    return points_in(half_size, count), directions(count)


def rotated(volume, resolution, angle=0.4, center=(0.2, -0.1, 0.0), scale=(0.5, 0.3, 0.6)):
    rotation = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return ProbeVolume(volume, build.transform(center, scale, rotation), resolution)


@pytest.fixture(scope="module")
def box():
    return bake(build.closed_box(albedo=0.6, light_position=(0.2, -0.3, 0.4), resolution=(4, 5, 3), half_size=0.9), **QUICK)


@pytest.mark.parametrize("lookup", [LookupSettings(), LookupSettings(reconstruction="linear"),
                                    LookupSettings(reconstruction="geomerics"), LookupSettings(reconstruction="zh3"),
                                    LookupSettings(visibility=False), LookupSettings(normal_weight=False),
                                    LookupSettings(visibility=False, normal_weight=False)], ids=str)
def test_every_way_of_reading(indirect, box, lookup):
    # Half of the receivers lie outside of the volume and take its outermost probes.
    assert agrees(indirect, box.with_lookup(lookup), *receivers_in(1.3))


@pytest.mark.parametrize("order", [0, 1, 3, 4, 7])
def test_every_order(indirect, order):
    field = bake(build.closed_box(albedo=0.6, light_position=(0.6, -0.3, 0.4), resolution=(2, 2, 2)), order=order, **QUICK)
    assert agrees(indirect, field, *receivers_in(1.0))


@pytest.mark.parametrize("lookup", [LookupSettings(), LookupSettings(reconstruction="zh3"), LookupSettings(visibility=False)],
                         ids=str)
def test_scattered_probes_alone_and_beside_a_lattice(indirect, box, lookup):
    grids = bake(scattered(storeys()), **QUICK).grids()
    for field in (ProbeField(grids, lookup=lookup), ProbeField((*grids, *box.grids()), lookup=lookup)):
        assert agrees(indirect, field, *receivers_in(2.6))


def test_rooms_that_do_not_see_each_other_and_dead_probes(indirect):
    field = bake(rooms.two_rooms(thickness=0.3, resolution=(9, 4, 4), half_size=(2.4, 1.2, 1.2)), **QUICK)
    grid, rng = field.grids()[0], np.random.default_rng(2)
    dead, moved = rng.random(grid.validity.shape) < 0.4, rng.random(grid.validity.shape) < 0.2
    offset = np.where(moved[..., None], rng.normal(0.0, 0.05, grid.offset_world.shape), 0.0).astype(np.float32)
    field = ProbeField([replace(grid, validity=np.where(dead, 0.0, 1.0).astype(np.float32), offset_world=offset)])
    assert not field.lookups[0].live.all()
    assert agrees(indirect, field, *receivers_in(np.array([2.2, 1.05, 1.05])))


def test_several_volumes_blend(indirect):
    scene = build.closed_box(albedo=0.6, light_position=(0.2, -0.3, 0.4))
    fine = replace(rotated("fine", (4, 3, 5)), settings={"order": 1, "visibility_resolution": 6})
    flat = rotated("flat", (6, 1, 2), -0.7, (0.0, 0.3, -0.4), (0.8, 0.4, 0.3))
    field = bake(replace(scene, volumes=(build.volume("coarse", (3, 3, 3), 0.8), flat, fine)), **QUICK)
    assert len({grid.order for grid in field.grids()}) == 2
    assert agrees(indirect, field, *receivers_in(1.4, 6000))


def test_far_from_the_origin(indirect, box):
    far = np.array([3000.0, -2000.0, 500.0])
    grids = [replace(grid, volume=replace(grid.volume, world_from_local=build.transform(far, 0.9))) for grid in box.grids()]
    points, normals = receivers_in(0.9)
    points = (points + far).astype(np.float32)
    assert agrees(indirect, ProbeField(grids), points, normals)


def test_no_field_is_the_world(indirect):
    made = indirect.make_indirect(None, build.open_plane(world=0.5))
    points, normals = receivers_in(1.0, 100)
    assert error(made, np.full((100, 3), 0.5 * np.pi), points, normals).max() < TYPICAL


def test_a_field_without_a_function_of_its_own_is_its_grids(indirect, box):
    class Other(ProbeField.__base__):
        technique = "other"
        params, stats = {}, {}

        def irradiance(self, points, normals):
            raise NotImplementedError

        def arrays(self):
            return {}

        def grids(self):
            return box.grids()

    made = indirect.make_indirect(Other(), None)
    points, normals = receivers_in(1.3)
    assert error(made, box.irradiance(points, normals), points, normals).max() < WORST
    assert not made.follow(build.closed_box()) and "bake again" in made.error


def test_a_moved_lamp_arrives_through_a_worker(indirect, box):
    scene = build.closed_box(albedo=0.6, light_position=(-0.4, 0.3, 0.1), resolution=(4, 5, 3), half_size=0.9)
    made = indirect.make_indirect(box, None)
    points, normals = receivers_in(0.9)
    # The first is worked on, the second waits, and is forgotten for the third.
    for position in ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)):
        assert made.follow(replace(scene, lights=(build.point_light(position),)))
    assert made.follow(scene)
    assert waited(made)
    expected = box.relight(scene).irradiance(points, normals)
    assert error(made, expected, points, normals).max() < WORST
    assert np.abs(expected - box.irradiance(points, normals)).max() > 0.05 * expected.max()
    assert made.error is None
    made.close()


def test_changed_geometry_is_said(indirect, box):
    made = indirect.make_indirect(box, None)
    made.follow(build.closed_box(albedo=0.6, half_size=2.0))
    assert not waited(made)
    assert "bake again" in made.error
    made.close()
