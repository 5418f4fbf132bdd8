"""What no eye gets to see of surfaces in cells: the inside of solids and what lies in there."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.evaluate.stability.parts import box, quad, volume
from rtgi_addon.progress import Progress
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at
from rtgi_addon.transport.voxels import grid_around, voxelize
from rtgi_addon.transport.voxels.unseen import shown_alone, within_solids

LOW, HIGH = np.array([-0.31, -0.23, 0.0]), np.array([0.27, 0.33, 0.5])


def standing(lights=(), emission=0.0, sunk=0.0):
    """A red box that stands on a grey floor, or is ``sunk`` into it."""
    return build.scene([quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0)), box("box", LOW - [0, 0, sunk], HIGH, material=1)],
                       [build.material("floor", 0.7), build.material("box", (0.8, 0.1, 0.1), emission)], lights,
                       volumes=[volume((-0.9, -0.9, 0.05), (0.9, 0.9, 0.9), (3, 3, 3))])


def in_voxels(scene):
    context = LightContext(scene, 1)
    return context, voxelize(context.geometry, context.surfaces, grid_around(np.array(context.geometry.bounds()), 24), 1)


@pytest.mark.parametrize("sunk", [0.0, 0.07])
def test_the_inside_of_a_box_and_the_floor_in_it_are_not_seen(sunk):
    context, voxels = in_voxels(standing(sunk=sunk))
    hidden, seen = within_solids(context, voxels), voxels.seen
    points = context.geometry.points(seen.primitive, seen.u, seen.v)
    of_floor = context.geometry.instance[seen.primitive] == 0
    beneath = np.all((points[:, :2] > LOW[:2]) & (points[:, :2] < HIGH[:2]), axis=1)
    # Both sides of a floor that goes through it; and of one that it stands on the side that lines find in it.
    in_it = beneath if sunk else beneath & (seen.side > 0)
    assert np.array_equal(hidden, np.where(of_floor, in_it, seen.side < 0))
    assert (~of_floor & hidden).any() and (of_floor & hidden).any() == (sunk > 0)


def test_a_box_that_serves_as_a_room_is_seen_from_within():
    context, voxels = in_voxels(standing([build.point_light((0.0, 0.0, 0.2))]))
    assert not within_solids(context, voxels).any()


def test_what_is_hidden_takes_no_part_in_what_its_face_shows():
    context, voxels = in_voxels(standing())
    hidden, face = within_solids(context, voxels), voxels.seen.face
    light = np.where(hidden[:, None], np.float32(100), np.float32([[0.5, 0.0, 2.0]]))
    shown = voxels.by_face(shown_alone(voxels, hidden, light)).reshape(-1, 3)
    weight = np.bincount(face, voxels.seen.weight, len(shown))
    partly = np.bincount(face[~hidden], minlength=len(shown)) > 0
    assert shown[partly] == pytest.approx(weight[partly, None] * light[~hidden][:1], rel=1e-5)
    assert (shown[~partly] == 0).all() and (weight[~partly] > 0).any()
    assert (light[hidden] == 100).all()


@pytest.mark.parametrize(("name", "settings"), [("cone_tracing", {"cones": 64}), ("voxel_march", {"rays": 256})])
def test_a_box_that_glows_sends_what_its_outside_does(name, settings):
    # Its inside holds five times the red, of all bounces.
    scene = standing(emission=1.0)
    x = np.linspace(-0.3, 0.3, 13)
    points = np.stack([x, np.full(13, LOW[1] - 0.15), np.zeros(13)], axis=1).astype(np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (13, 1))
    exact = irradiance_at(LightContext(scene, 1), points, normals, 512, seed=3).mean.mean(axis=0)
    technique = techniques.get(name)
    field = technique.bake(scene, technique.Settings(resolution=32, **settings), np.random.default_rng(1), Progress(), threads=1)
    found = field.irradiance(points, normals).mean(axis=0)
    assert found == pytest.approx(exact, rel=0.15) and found[0] / found[1] == pytest.approx(exact[0] / exact[1], rel=0.03)
