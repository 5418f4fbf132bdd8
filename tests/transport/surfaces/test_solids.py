"""What counts as solid: closed, outward shells with nothing inside that emits or looks."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.scene import Camera, Instance, SunLight
from rtgi_addon.transport.surfaces.geometry import flatten
from rtgi_addon.transport.surfaces.materials import Surfaces
from rtgi_addon.transport.surfaces.solids import Solids, closed_components, winding_number


def joined(*meshes):
    """One mesh of several parts."""
    offsets = np.cumsum([0, *(len(mesh.vertices_local) for mesh in meshes)])
    return build.mesh("joined", np.concatenate([mesh.vertices_local for mesh in meshes]),
                      np.concatenate([mesh.triangles + offset for mesh, offset in zip(meshes, offsets, strict=False)]))


def moved(mesh, offset):
    return replace(mesh, vertices_local=mesh.vertices_local + np.float32(offset))


def without(mesh, *rows):
    return build.mesh(mesh.name, mesh.vertices_local, np.delete(mesh.triangles, rows, axis=0))


def solid(scene):
    """Whether each triangle of a scene bounds a solid."""
    geometry = flatten(scene)
    return Solids(scene, geometry, Surfaces(scene, geometry)).is_solid(np.arange(geometry.count))


def test_a_cube_is_one_closed_part_and_an_open_box_is_not():
    label, closed = closed_components(build.cube())
    assert not label.any() and closed.tolist() == [True]
    assert closed_components(without(build.cube(), 2))[1].tolist() == [False]
    assert closed_components(build.plane())[1].tolist() == [False]
    assert closed_components(build.sphere(subdivisions=3))[1].tolist() == [True]


def test_each_part_of_a_mesh_is_judged_by_itself():
    parts = joined(build.cube(), moved(build.plane(), (5, 0, 0)), moved(build.sphere(subdivisions=2), (0, 9, 0)))
    label, closed = closed_components(parts)
    assert len(closed) == 3
    assert closed[label[:12]].all() and not closed[label[12:14]].any() and closed[label[14:]].all()
    assert len(set(label[:12])) == len(set(label[12:14])) == len(set(label[14:])) == 1


def test_long_strips_of_triangles_are_one_part():
    """Labels must travel along a thousand neighbours in shuffled order."""
    n = 2000
    vertices = np.stack([np.arange(n), np.arange(n) % 2, np.zeros(n)], axis=1)
    triangles = np.stack([np.arange(n - 2), np.arange(n - 2) + 1, np.arange(n - 2) + 2], axis=1)
    order = np.random.default_rng(0).permutation(n)
    shuffled = np.random.default_rng(1).permutation(np.argsort(order)[triangles])
    assert not closed_components(build.mesh("strip", vertices[order], shuffled))[0].any()


def test_edges_shared_by_more_or_running_the_same_way_are_not_closed():
    cube = build.cube()
    fin = build.mesh("fin", np.vstack([cube.vertices_local, [[0, 0, 5]]]), np.vstack([cube.triangles, [[4, 5, 8]]]))
    assert closed_components(fin)[1].tolist() == [False]
    flipped = cube.triangles.copy()
    flipped[0] = flipped[0, ::-1]
    assert closed_components(build.mesh("flipped", cube.vertices_local, flipped))[1].tolist() == [False]
    twice = build.mesh("twice", cube.vertices_local, np.vstack([cube.triangles, cube.triangles]))
    assert closed_components(twice)[1].tolist() == [False]


def split_vertices(mesh):
    """The same triangles with three vertices each of their own, as a file writes them where normals or UV break."""
    return build.mesh(mesh.name, mesh.vertices_local[mesh.triangles.reshape(-1)], np.arange(mesh.triangles.size).reshape(-1, 3))


def test_vertices_split_for_normals_leave_a_solid_closed():
    label, closed = closed_components(split_vertices(build.cube()))
    assert not label.any() and closed.tolist() == [True]
    assert closed_components(split_vertices(without(build.cube(), 2)))[1].tolist() == [False]
    assert not closed_components(split_vertices(build.cube(inward=True)))[0].any()
    scene = build.scene([split_vertices(build.cube())])
    assert solid(scene).all()


def test_solids_that_only_touch_stay_solids_of_their_own():
    """Two boxes with an edge in common have four triangles at it, but none of the vertices is shared."""
    parts = joined(build.cube(), moved(build.cube(), (2, 2, 0)), moved(split_vertices(build.sphere(subdivisions=2)), (9, 0, 0)))
    label, closed = closed_components(parts)
    assert closed.tolist() == [True] * 3
    assert len(set(label[:12])) == len(set(label[12:24])) == len(set(label[24:])) == 1


@pytest.mark.parametrize("mesh", [build.cube(), build.sphere(subdivisions=2), build.cube(inward=True)],
                         ids=["cube", "sphere", "room"])
def test_winding_number(mesh):
    triangles = mesh.vertices_local[mesh.triangles].astype(np.float64)
    for point, inside in (((0, 0, 0), 1), ((0.3, -0.4, 0.5), 1), ((0, 0, 1.5), 0), ((3, 0.2, 0.1), 0), ((0, 0, -99), 0)):
        assert winding_number(triangles, np.array(point, float)) == pytest.approx(inside, abs=1e-9)
    ring = joined(mesh, build.mesh("again", mesh.vertices_local * 1.5, mesh.triangles))
    twice = ring.vertices_local[ring.triangles].astype(np.float64)
    assert winding_number(twice, np.zeros(3)) == pytest.approx(2, abs=1e-9)


def test_a_crate_is_solid_and_a_room_is_not():
    crate, room = build.cube("crate", 0.3), build.cube("room", 2.0, inward=True)
    assert solid(build.scene([crate, room], lights=[build.point_light((1, 0, 0))])).tolist() == [True] * 12 + [False] * 12


def test_a_box_built_as_a_room_counts_by_what_is_in_it():
    """Users model rooms as plain cubes, normals outward: a lamp, a camera or a glowing thing inside tells."""
    room = build.cube("room", 2.0)
    camera = Camera("eye", build.transform((0.5, 0.5, 0)), np.eye(4), (10, 10))
    assert solid(build.scene([room])).all()
    assert not solid(build.scene([room], lights=[build.point_light()])).any()
    assert not solid(replace(build.scene([room]), cameras=(camera,))).any()
    glowing = build.scene([room, moved(build.plane(half_size=0.2, material_index=1), (0.5, 0.1, 0))],
                          [build.material(), build.material("glow", 0.0, 1.0)])
    assert not solid(glowing).any()


def test_walls_of_real_thickness_are_solid_about_what_is_in_their_rooms():
    """One mesh as buildings are modelled: an outer shell, a room in it that faces inwards, a crate in the room."""
    shell, room, crate = build.cube("shell", 2.0), build.cube("room", 1.5, inward=True), build.cube("crate", 0.3)
    house = joined(shell, room, crate)
    camera = Camera("eye", build.transform((0.5, 1.0, 0)), np.eye(4), (10, 10))
    for lamp, walls, furniture in (((1, 0, 0), True, True), ((1.8, 0, 0), False, True), ((0.1, 0, 0), True, False)):
        scene = build.scene([house], lights=[build.point_light(lamp)])
        assert solid(replace(scene, cameras=(camera,))).tolist() == [walls] * 24 + [furniture] * 12
    # A room that is in no shell is the box that it always was.
    assert not solid(build.scene([joined(build.cube(), moved(room, (5, 0, 0)))]))[12:].any()


def test_lamps_outside_and_suns_make_no_room():
    crate = build.cube("crate")
    sun = SunLight("sun", np.float32([0, 0, -1]), np.ones(3, np.float32))
    assert solid(build.scene([crate], lights=[build.point_light((0, 0, 3)), build.point_light((1.2, 0, 0)), sun])).all()


def test_an_emissive_crate_is_no_room_to_itself():
    assert solid(build.scene([build.cube("lantern")], [build.material("glow", 0.0, 1.0)])).all()


def test_a_concave_box_is_a_room_only_where_the_lamp_is_inside_it():
    """The bounding box holds the lamp, the shell does not: an L of two boxes joined into one closed mesh."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    vertices = np.vstack([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 1.0)])
    top = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]) + 6
    sides = [[i, (i + 1) % 6, (i + 1) % 6 + 6] for i in range(6)] + [[i, (i + 1) % 6 + 6, i + 6] for i in range(6)]
    corner = build.mesh("L", vertices, np.vstack([top, top[:, ::-1] - 6, sides]))
    assert closed_components(corner)[1].all()
    assert solid(build.scene([corner], lights=[build.point_light((1.5, 1.5, 0.5))])).all()
    assert not solid(build.scene([corner], lights=[build.point_light((0.5, 1.5, 0.5))])).any()


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (-1, -2, -0.5), (0.1, -3, 1)], ids=str)
def test_mirrored_instances_keep_their_outside(scale):
    crate, room = build.cube("crate", 0.3), build.cube("room", 2.0, inward=True)
    scene = build.scene([crate, room])
    scene = replace(scene, instances=(Instance("crate", 0, build.transform((5, 0, 0), scale)),
                                      Instance("room", 1, build.transform((0, 0, 0), scale))))
    assert solid(scene).tolist() == [True] * 12 + [False] * 12


def test_a_face_without_area_does_not_open_a_solid():
    cube = build.cube()
    repeated = build.mesh("cube", np.concatenate([cube.vertices_local, cube.vertices_local[:1]]),
                          np.concatenate([cube.triangles, [[0, 8, 1], [2, 2, 5]]]))
    label, closed = closed_components(repeated)
    assert closed[label[:12]].all()
    label, closed = closed_components(without(repeated, 3))
    assert not closed[label[:11]].any()
