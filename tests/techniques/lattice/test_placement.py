"""Where probes stand: away from the surfaces that a lattice happens to lie on, on the side that they face."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.numerics.grid import lattice_points
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.lattice.placement import CLEARANCE, place
from rtgi_addon.transport.context import LightContext


def room_with_lattice(half_size):
    """A closed 2 m room under a lattice of 5 probes a side."""
    return build.scene([build.cube("room", 1.0, inward=True)], lights=[build.point_light()],
                       volumes=[build.volume(resolution=(5, 5, 5), half_size=half_size)])


def placed(scene, offset=True):
    return place(LightContext(scene, 1), scene.volumes, offset, Progress())


@pytest.mark.parametrize("beyond", [-0.001, 0.0, 0.001, 0.019])
def test_probes_on_a_rooms_walls_go_into_the_room(beyond):
    # A lattice of 5 cells of 0.5 m whose outermost layers lie on the walls of a 2 m room, corners and edges included.
    half = 1.25 * (1.0 + beyond)
    scene = room_with_lattice(half)
    result, cell = placed(scene), 2 * half / 5
    assert result.measured.all()
    assert np.abs(result.positions).max() <= 1.0 - 0.98 * CLEARANCE * cell
    inner = np.all(np.abs(lattice_points(scene.volumes[0].world_from_local, (5, 5, 5)).reshape(-1, 3)) < 0.9, axis=1)
    assert inner.sum() == 27 and not result.offset[inner].any() and np.any(result.offset[~inner] != 0, axis=1).all()


def test_a_sheet_sends_probes_to_the_side_it_faces():
    sheet = build.plane(half_size=3.0)
    scene = build.scene([sheet], volumes=[build.volume(resolution=(2, 2, 3), half_size=(1, 1, 1.5))])
    result = placed(scene)
    layer = result.positions[4:8]
    assert np.allclose(layer[:, 2], CLEARANCE, atol=1e-6) and not result.offset[:4].any() and not result.offset[8:].any()
    below = build.scene([build.mesh("sheet", sheet.vertices_local, sheet.triangles[:, ::-1])], volumes=scene.volumes)
    assert np.allclose(placed(below).positions[4:8, 2], -CLEARANCE, atol=1e-6)


def test_a_probe_beside_a_box_with_a_turned_face_does_not_end_in_the_box():
    """It is clear of that face; one a little behind a room's wall, which shows it no back from within, still goes in."""
    box = build.cube(half_size=0.5)
    half_turned = box.triangles.copy()
    half_turned[[0, 1, 4, 5, 8, 9]] = half_turned[[0, 1, 4, 5, 8, 9], ::-1]
    beside = build.volume(resolution=(2, 1, 1), half_size=1.2, center=(-1.2, 0.0, 0.0))
    scene = build.scene([build.mesh("half turned", box.vertices_local, half_turned)], volumes=[beside])
    points = lattice_points(beside.world_from_local, (2, 1, 1)).reshape(-1, 3)
    distance = -0.5 - points[:, 0].max()
    assert CLEARANCE * 1.2 < distance < 0.2 * 1.2
    assert not placed(scene).offset.any()
    outside = room_with_lattice(1.25 * 1.05)
    points = lattice_points(outside.volumes[0].world_from_local, (5, 5, 5)).reshape(-1, 3)
    behind_one = np.count_nonzero(np.abs(points) > 1.0, axis=1) == 1
    assert behind_one.sum() == 54 and np.abs(placed(outside).positions[behind_one]).max() < 1.0


def test_a_turned_lattice_keeps_probes_as_far_off_as_its_shortest_side_says():
    cosine = np.sqrt(0.5)
    turn = np.array([[cosine, -cosine, 0, 0], [cosine, cosine, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    cells = build.volume(resolution=(2, 2, 3), half_size=(1.0, 4.0, 6.0))
    turned = replace(cells, world_from_local=turn @ cells.world_from_local)
    result = placed(build.scene([build.plane(half_size=12.0)], volumes=[turned]))
    assert np.allclose(result.positions[4:8, 2], CLEARANCE * 1.0, atol=1e-6)


def test_without_virtual_offset_probes_stay():
    assert not placed(room_with_lattice(1.25), offset=False).offset.any()
