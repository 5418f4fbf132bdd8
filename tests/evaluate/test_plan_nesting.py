"""Volumes in volumes: where boxes are placed, that they lie on their parent's cells, and that a plan with them keeps its word."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.evaluate.plan import Target, make_plan, nesting
from rtgi_addon.evaluate.plan.nesting import RATIO, Box, best_box, nested_volume, probes_in
from rtgi_addon.evaluate.plan.pilot import LEVELS, Pilot
from rtgi_addon.evaluate.plan.sample import NORMALS_PER_POINT, draw_sample
from rtgi_addon.numerics.grid import box_corners, cell_size, lattice_from_world
from rtgi_addon.progress import Progress
from rtgi_addon.transport.context import LightContext


def points_in(volume, count=4000, seed=0):
    """Points (n, 3) all over ``volume``, and their lattice coordinates counted from its side."""
    local = np.random.default_rng(seed).uniform(-1, 1, (count, 3))
    world = local @ volume.world_from_local[:3, :3].T + volume.world_from_local[:3, 3]
    return world, lattice_from_world(volume.world_from_local, volume.resolution, world) + 0.5


def test_a_box_is_placed_about_the_error_and_none_where_it_is_everywhere():
    volume = build.volume(resolution=(6, 7, 5), half_size=(1.0, 2.0, 0.5), center=(3.0, 1.0, 0.0))
    points, cells = points_in(volume)
    inside = np.all((cells >= [1, 3, 0]) & (cells < [3, 5, 1]), axis=1)
    errors = np.where(inside, 1.0, 1e-3)
    box = best_box(volume, points, errors / errors.sum(), probes_in((volume,)))
    assert (box.low == (1, 3, 0) and box.high == (3, 5, 1)) or np.all(np.abs(np.array(box.low) - [1, 3, 0]) <= 1)
    assert np.all(np.array(box.low) <= [1, 3, 0]) and np.all(np.array(box.high) >= [3, 5, 1])
    assert np.prod(np.array(box.high) - box.low) < 0.3 * 210 and box.gain > 0.4
    even = np.ones(len(points))
    assert best_box(volume, points, even / even.sum(), probes_in((volume,))) is None or \
        best_box(volume, points, even / even.sum(), 60 * probes_in((volume,))).gain > 0.7
    assert best_box(volume, points, np.zeros(len(points)), 210) is None


def test_a_box_is_looked_for_in_a_lattice_of_many_cells():
    volume = build.volume(resolution=(40, 36, 30), half_size=1.0)
    points, cells = points_in(volume, 20000)
    errors = np.all((cells >= [8, 8, 8]) & (cells < [16, 16, 16]), axis=1).astype(float)
    box = best_box(volume, points, errors / errors.sum(), probes_in((volume,)))
    assert np.all(np.array(box.low) >= 4) and np.all(np.array(box.high) <= 20) and box.gain > 0.5


def test_a_nested_volume_lies_on_its_parents_cells_and_reaches_past_its_sides():
    turned = build.volume(resolution=(4, 5, 6), half_size=(1.0, 1.5, 2.0), center=(1.0, 2.0, 3.0))
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0, 0], [np.sin(angle), np.cos(angle), 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    parent = replace(turned, world_from_local=turn @ turned.world_from_local, settings={"order": 1}, intensity=2.0)
    fine = nested_volume(parent, Box((0, 1, 2), (2, 4, 6), 0.5), "fine")
    assert fine.planned == parent.name and fine.settings == parent.settings and fine.intensity == 2.0
    assert fine.resolution == (RATIO * 2 + 1, RATIO * 3, RATIO * 4 + 1)
    assert cell_size(fine.world_from_local, fine.resolution) == pytest.approx(
        cell_size(parent.world_from_local, parent.resolution) / RATIO)
    corners = lattice_from_world(parent.world_from_local, parent.resolution, box_corners(fine.world_from_local)) + 0.5
    assert corners.min(axis=0) == pytest.approx([-0.5, 1, 2]) and corners.max(axis=0) == pytest.approx([2, 4, 6.5])
    deeper = nested_volume(fine, Box((1, 1, 1), (2, 2, 2), 0.1), "finer")
    assert deeper.planned == parent.name


def test_a_pilot_measures_volumes_in_volumes_and_traces_no_probe_twice():
    scene = build.closed_box(albedo=0.7, light_position=(0.6, 0.5, 0.4))
    scene = replace(scene, volumes=(build.volume(resolution=(4, 4, 4), half_size=0.95),))
    context = LightContext(scene, 1)
    pilot = Pilot(context, scene.volumes, draw_sample(context, scene.volumes, 128, 1), (2,), 0.05, 0, Progress())
    alone = pilot.measure_volumes(scene.volumes, Progress())
    before = pilot.spent
    fine = nested_volume(scene.volumes[0], Box((2, 2, 2), (4, 4, 4), 0.5), "fine")
    both = pilot.measure_volumes((*scene.volumes, fine), Progress())
    assert both.lattice_points == alone.lattice_points + np.prod(fine.resolution)
    assert 0 < pilot.spent - before <= np.prod(fine.resolution) * 256
    assert both.error(2).value < alone.error(2).value
    assert pilot.measure_volumes((*scene.volumes, fine), Progress()) is both


def hall():
    """A long closed hall with a lamp near one of its ends: most of the error is there."""
    walls = build.mesh("hall", build.CUBE_CORNERS * [4.0, 1.0, 1.0], build.CUBE_TRIANGLES[:, ::-1])
    return build.scene([walls], [build.material("wall", 0.6)], [build.point_light((3.6, 0.5, 0.5), 1.0)],
                       volumes=[build.volume(resolution=(12, 4, 4), half_size=(3.95, 0.95, 0.95))])


def test_boxes_are_placed_where_the_error_is_until_what_they_are_read_by_will_do():
    scene = hall()
    context = LightContext(scene, 1)
    pilot = Pilot(context, scene.volumes, draw_sample(context, scene.volumes, 512, 1), (2,), 0.1, 0, Progress())
    level = len(LEVELS) - 1
    alone = pilot.measure_volumes(scene.volumes, Progress(), level).error(2).value
    found = nesting._with_boxes(pilot, scene.volumes, 2, level, 1000, lambda reading: len(reading.volumes) > 1, Progress())
    assert len(found.variance) == 256 * NORMALS_PER_POINT
    assert pilot.measure_volumes(found.volumes, Progress(), level).error(2).value < 0.9 * alone
    assert found.volumes[0] is scene.volumes[0] and len(found.volumes) == 2 and found.lattice_points <= 1000
    assert all(volume.world_from_local[0, 3] > 1.0 for volume in found.volumes[1:])
    assert nesting._with_boxes(pilot, scene.volumes, 2, level, 200, lambda reading: False, Progress()) is None


def test_a_plan_of_volumes_in_volumes_says_so_and_replaces_those_of_the_last(monkeypatch):
    scene = hall()

    def placed(pilot, base, order, level, most, passes, progress):
        fine = nested_volume(base[0], Box((0, 0, 0), (1, 1, 1), 0.5), f"{base[0].name} fine 1")
        return pilot.measure_volumes((*base, fine), progress, level - 1)

    monkeypatch.setattr(nesting, "_with_boxes", placed)
    plan = make_plan(scene, Target(0.12, nested=True), others=False, points=128, threads=1)
    assert plan.found.nesting == "nested" and plan.probes < plan.found.single.lattice_points
    name = scene.volumes[0].name
    assert [(volume.name, volume.planned) for volume in plan.volumes] == [(name, ""), (f"{name} fine 1", name)]
    said = " ".join(plan.reasons)
    assert "lies where most of the error was" in said and "Nested so" in said
    assert any(option.label == "nothing nested" for option in plan.options)
    applied = plan.applied(plan.applied(scene))
    assert [volume.name for volume in applied.volumes] == [volume.name for volume in plan.volumes]
    monkeypatch.setattr(nesting, "_with_boxes", lambda *_: None)
    alone = make_plan(applied, Target(0.12, nested=True), others=False, points=128, threads=1)
    assert alone.found.nesting == "spread" and "the error is spread" in " ".join(alone.reasons)
    assert [volume.name for volume in alone.applied(applied).volumes] == [name]
