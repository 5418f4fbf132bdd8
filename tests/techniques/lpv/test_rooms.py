"""Light summed over the surfaces of whole rooms, against the path tracer: rooms that nothing was chosen on, at every resolution."""

from functools import cache

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.lpv.settings import LpvSettings
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at
from rtgi_addon.transport.rays.tracer import offset_origins

MATERIALS = [build.material("white", 0.7), build.material("red", (0.6, 0.15, 0.1)), build.material("dark", 0.25)]


def faces(name, low, high, materials, outward=False, turn=None):
    """The six sides of a box that face in or out, in order -x, +x, -y, …, turned about the origin."""
    turn, quads = np.eye(3) if turn is None else turn, []
    for number, material in enumerate(materials):
        axis, end = divmod(number, 2)
        corner, edge_u, edge_v = np.array(low, float), np.zeros(3), np.zeros(3)
        corner[axis] = (low, high)[end][axis]
        one, other = (axis + 1) % 3, (axis + 2) % 3
        edge_u[one], edge_v[other] = high[one] - low[one], high[other] - low[other]
        if (end == 0) == outward:
            edge_u, edge_v = edge_v, edge_u
        quads.append(rooms.quad(f"{name} {number}", *(turn @ vector for vector in (corner, edge_u, edge_v)), material))
    return quads


def furnished(degrees=0.0):
    """An oblong room of three albedos with a table block and a lamp, turned about z."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    meshes = [*faces("room", (-1.83, -1.21, -1.07), (2.11, 1.77, 1.39), (0, 1, 0, 0, 2, 0), turn=turn),
              *faces("table", (0.3, -0.4, -1.07), (1.2, 0.5, -0.4), (0,) * 6, outward=True, turn=turn)]
    return build.scene(meshes, MATERIALS, [build.point_light(tuple(turn @ [-0.7, 0.3, 0.5]), 2.0)],
                       volumes=[build.volume(half_size=(1.7, 1.3, 1.0), center=(0.1, 0.25, 0.1))])


def corridor():
    """An L with its lamp at one end."""
    low, high = -1.2, 1.3
    outline = [(-3, -1), (3, -1), (3, 4), (1.3, 4), (1.3, 0.6), (-3, 0.6)]
    meshes = [rooms.quad(f"wall {number}", (x0, y0, low), (0, 0, high - low), (x1 - x0, y1 - y0, 0))
              for number, ((x0, y0), (x1, y1)) in enumerate(zip(outline, outline[1:] + outline[:1], strict=True))]
    for number, (x0, x1, y0, y1) in enumerate(((-3, 3, -1, 0.6), (1.3, 3, 0.6, 4))):
        across, along = (x1 - x0, 0, 0), (0, y1 - y0, 0)
        meshes += [rooms.quad(f"floor {number}", (x0, y0, low), across, along),
                   rooms.quad(f"top {number}", (x0, y0, high), along, across)]
    return build.scene(meshes, MATERIALS, [build.point_light((-2.2, -0.2, 0.6), 2.0)],
                       volumes=[build.volume(half_size=(2.9, 2.4, 1.1), center=(0, 1.5, 0))])


ROOMS = {"furnished": furnished, "turned": lambda: furnished(27.0), "corridor": corridor,
         "thin wall": lambda: rooms.two_rooms(0.02, half_size=(2.0, 0.95, 0.95)),
         "sun through a hole": lambda: rooms.sun_patch_room(half_size=(0.9, 0.9, 0.9))}


@cache
def known(name):
    """A room, points on its surfaces by area with their normals, and what they receive."""
    scene = ROOMS[name]()
    context = LightContext(scene)
    corners = context.geometry.triangles_world.astype(np.float64)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    rng = np.random.default_rng(2)
    count = 400
    chosen = np.searchsorted(np.cumsum(area) / area.sum(), (np.arange(count) + rng.random(count)) / count)
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1, 1 - u, u)[:, None], np.where(u + v > 1, 1 - v, v)[:, None]
    origin, first, second = corners[chosen].transpose(1, 0, 2)
    normals = context.geometry.normals_world[chosen]
    points = offset_origins((origin + u * (first - origin) + v * (second - origin)).astype(np.float32), normals, normals)
    return scene, points, normals, irradiance_at(context, points, normals, 384, seed=5).mean


def received(name, **settings):
    """Light at the points of a room, from light propagation volumes and from the path tracer."""
    scene, points, normals, exact = known(name)
    field = techniques.get("lpv").bake(scene, LpvSettings(**settings), np.random.default_rng(0), Progress())
    return field.irradiance(points, normals), exact


@pytest.mark.parametrize("resolution", [8, 16, pytest.param(32, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ROOMS)
def test_the_sum_over_surfaces_is_right_at_any_resolution(name, resolution):
    found, exact = received(name, resolution=resolution)
    assert found.sum() == pytest.approx(exact.sum(), rel=0.2)


@pytest.mark.parametrize(("name", "most"), [("furnished", 0.25), ("turned", 0.3), ("corridor", 0.2), ("thin wall", 0.2)])
def test_light_is_about_where_it_should_be(name, most):
    found, exact = received(name)
    assert np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)) < most


@pytest.mark.parametrize("resolution", [8, 16])
def test_nothing_stands_behind_a_wall_of_two_centimetres(resolution):
    found, _ = received("thin wall", resolution=resolution)
    dark = known("thin wall")[1][:, 0] > 0
    assert found[dark].mean() < 1e-5 * found[~dark].mean()
