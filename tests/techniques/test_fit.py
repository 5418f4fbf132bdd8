"""The volume that is made for a scene without one: around what stands by itself, inside what has an inside."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from room_scenes import moved

from rtgi_addon.scene import Instance
from rtgi_addon.techniques.lattice.fit import fit_volume


def fitted(*meshes, lamps=()):
    """Lowest and highest corner (3,) of the volume fitted to ``meshes``."""
    volume = fit_volume(build.scene(meshes, lights=lamps, volumes=()))
    center, half = volume.world_from_local[:3, 3], np.diag(volume.world_from_local)[:3]
    assert volume.fitted and np.prod(volume.resolution) <= 4096
    return center - half, center + half


def opened(mesh, *triangles):
    return build.mesh(mesh.name, mesh.vertices_local, np.delete(mesh.triangles, triangles, axis=0))


@pytest.mark.parametrize("meshes", [
    [build.cube()], [build.sphere()], [opened(build.sphere(), 0, 7)],
    [moved(build.cube(str(x)), (x, 0, 0)) for x in (-2.6, 0, 2.6)]], ids=["cube", "sphere", "sphere with a hole", "three cubes"])
def test_around_what_stands_by_itself_it_reaches_outwards(meshes):
    low, high = fitted(*meshes)
    corners = np.concatenate([mesh.vertices_local for mesh in meshes])
    margin = 0.5 * np.ptp(corners, axis=0).max()
    np.testing.assert_allclose(low, corners.min(axis=0) - margin, rtol=1e-5)
    np.testing.assert_allclose(high, corners.max(axis=0) + margin, rtol=1e-5)


LAMP = [build.point_light((0.2, 0.1, 0.3))]


@pytest.mark.parametrize(("meshes", "lamps"), [
    ([build.cube(inward=True)], ()), ([build.cube()], LAMP), ([build.sphere(inward=True)], ()),
    ([opened(build.cube(inward=True), 2, 3)], ()), ([opened(build.cube(inward=True), 2, 3, 4, 5)], ()),
    ([build.cube(inward=True), build.cube("thick", 0.8)], ())],
    ids=["room", "box with a lamp in it", "inside of a sphere", "courtyard", "no front and no roof", "room full of a block"])
def test_what_has_an_inside_is_filled_and_no_more(meshes, lamps):
    low, high = fitted(*meshes, lamps=lamps)
    np.testing.assert_allclose([low, high], [[-1] * 3, [1] * 3], atol=1e-5)


def test_what_stands_on_a_floor_is_not_looked_at_from_below():
    low, high = fitted(moved(build.cube(half_size=0.5), (0, 0, 0.5)), build.plane(half_size=1.5))
    np.testing.assert_allclose([low, high], [[-1.5, -1.5, 0], [1.5, 1.5, 1]], atol=1e-5)


def test_instances_that_are_not_finite_do_not_decide():
    scene = build.scene([build.cube(), build.cube("lost")], volumes=())
    lost = Instance("lost", 1, np.full((4, 4), np.nan))
    assert np.isfinite(fit_volume(replace(scene, instances=(scene.instances[0], lost))).world_from_local).all()
