"""Rooms whose walls have a UV map for the light atlas, and a floor that its map cuts in two."""

from dataclasses import replace

import numpy as np
from scene_builders import closed_box, material, mesh, point_light, scene, volume

GAP = 0.04


def in_atlas(built, index=0, uv=None, name="Lightmap"):
    """``built`` with its instance ``index`` in the atlas, by the map ``uv`` (t, 3, 2); None: none is added."""
    meshes, instances = list(built.meshes), list(built.instances)
    if uv is not None:
        layers = {**meshes[index].uv_layers, name: np.asarray(uv, np.float32)}
        meshes[index] = replace(meshes[index], uv_layers=layers, active_uv=name)
    instances[index] = replace(instances[index], atlas="")
    return replace(built, meshes=tuple(meshes), instances=tuple(instances))


def cube_map(built, index=0, gap=GAP):
    """(12, 3, 2): the six faces of a cube in cells of three by two."""
    cube, uv = built.meshes[index], np.zeros((12, 3, 2), np.float32)
    for face in range(6):
        corners = cube.vertices_local[cube.triangles[2 * face:2 * face + 2]]
        normal = np.cross(corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0])
        axes = [axis for axis in range(3) if axis != np.argmax(np.abs(normal))]
        place = (corners[..., axes] - corners[..., axes].min()) / np.ptp(corners[..., axes])
        uv[2 * face:2 * face + 2] = np.array([face % 3, face // 3]) / 3 + gap + place * (1 / 3 - 2 * gap)
    return uv


def room(built=None):
    """A closed room with a lamp, whose walls are in the atlas."""
    built = built or closed_box()
    return in_atlas(built, 0, cube_map(built))


def cut_floor():
    """A floor whose halves are islands apart, one of them turned, and a wall that a lamp lights on one side of it."""
    x = np.array([-2.0, -0.03, 2.0])
    vertices = np.array([[a, b, 0.0] for b in (-1.0, 1.0) for a in x])
    floor = mesh("floor", vertices, [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    left, right = [(0.03, 0.03), (0.43, 0.03), (0.43, 0.44), (0.03, 0.44)], [(0.9, 0.52), (0.9, 0.94), (0.5, 0.94), (0.5, 0.52)]
    uv = [[left[0], left[1], left[2]], [left[0], left[2], left[3]], [right[0], right[1], right[2]], [right[0], right[2], right[3]]]
    wall = mesh("wall", [[2.0, -1.5, 0.0], [2.0, 1.5, 0.0], [2.0, 1.5, 2.0], [2.0, -1.5, 2.0]], [[0, 2, 1], [0, 3, 2]])
    built = scene([floor, wall], [material("grey", 0.7)], [point_light((0.5, 0.0, 1.0), 5.0)], world=0.2,
                  volumes=[volume(half_size=0.4, center=(0.0, 0.0, 0.7))], name="cut_floor")
    return in_atlas(built, 0, uv)
