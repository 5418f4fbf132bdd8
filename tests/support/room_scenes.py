"""Rooms that each make one kind of light transport hard: a sun patch, a dark room next door, panels, cut-outs, many lamps."""

from dataclasses import replace

import numpy as np
import scene_builders as build

from rtgi_addon.scene import Channel, Material, SunLight, Texture, World


def moved(mesh, offset):
    """The mesh shifted by ``offset`` (3,)."""
    return replace(mesh, vertices_local=mesh.vertices_local + np.float32(offset))


def quad(name, corner, edge_u, edge_v, material_index=0):
    """A parallelogram facing along edge_u × edge_v, with UVs 0 to 1 along its edges."""
    corner, edge_u, edge_v = (np.asarray(vector, np.float32) for vector in (corner, edge_u, edge_v))
    corners = [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v]
    mesh = build.mesh(name, corners, [[0, 1, 2], [0, 2, 3]], material_index)
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)
    return replace(mesh, uv_layers={"UV": uv}, active_uv="UV")


def sun_patch_room(albedo=0.7, hole=0.25, **volume_options):
    """A closed 2 m cube whose ceiling has a square hole of side ``2·hole``, through which a slanting sun lights a patch."""
    walls = build.cube("walls", 1.0, inward=True)
    walls = build.mesh("walls", walls.vertices_local, np.delete(walls.triangles, [2, 3], axis=0))
    # Four strips about the hole; they face down.
    strips = [quad("west", (-1, -1, 1), (0, 2, 0), (1 - hole, 0, 0)), quad("east", (hole, -1, 1), (0, 2, 0), (1 - hole, 0, 0)),
              quad("south", (-hole, -1, 1), (0, 1 - hole, 0), (2 * hole, 0, 0)),
              quad("north", (-hole, hole, 1), (0, 1 - hole, 0), (2 * hole, 0, 0))]
    direction = np.array([0.3, 0.15, -1.0])
    sun = SunLight("sun", (direction / np.linalg.norm(direction)).astype(np.float32), np.float32([20, 18, 15]), angle=0.01)
    return build.scene([walls, *strips], [build.material("wall", albedo)], [sun], volumes=[build.volume(**volume_options)],
                       name="sun_patch_room")


def two_rooms(thickness=0.05, albedo=0.7, **volume_options):
    """Two closed 2 m cubes side by side, ``thickness`` of wall between them; the one at −x has a lamp, the other none.

    The floor and ceiling are single quads that run on under the wall, as people model them.
    """
    inner = 0.5 * thickness
    low, high = -2.0 - inner, 2.0 + inner
    along = (high - low, 0, 0)
    meshes = [quad("floor", (low, -1, -1), along, (0, 2, 0)), quad("ceiling", (low, -1, 1), (0, 2, 0), along),
              quad("front", (low, -1, -1), (0, 0, 2), along), quad("back", (low, 1, -1), along, (0, 0, 2)),
              quad("west", (low, -1, -1), (0, 2, 0), (0, 0, 2)), quad("east", (high, -1, -1), (0, 0, 2), (0, 2, 0)),
              quad("wall of the lit", (-inner, -1.01, -1.01), (0, 0, 2.02), (0, 2.02, 0)),
              quad("wall of the dark", (inner, -1.01, -1.01), (0, 2.02, 0), (0, 0, 2.02))]
    options = {"resolution": (4, 1, 1), "half_size": (2.0, 0.6, 0.6)} | volume_options
    return build.scene(meshes, [build.material("wall", albedo)], [build.point_light((-1.2, 0.2, 0.3), 2.0)],
                       volumes=[build.volume(**options)], name="two_rooms")


def panel_room(albedo=0.5, side=0.4, emission=10.0, **volume_options):
    """A closed box lit only by a small emissive panel under its ceiling."""
    panel = quad("panel", (-0.5 * side, -0.5 * side, 0.9), (0, side, 0), (side, 0, 0), 1)
    return build.scene([build.cube("room", 1.0, inward=True), panel],
                       [build.material("wall", albedo), build.material("glow", 0.2, emission)],
                       volumes=[build.volume(**volume_options)], name="panel_room")


def spotted_room(texels=256, radiance=3e5, **volume_options):
    """A closed box under a black panel of which one texel of ``texels``² shines; and the same with that texel as a square of its
    own, which has the same light."""
    side, column, row = 1.6, 200, 37
    corner = np.float32([-0.5 * side, -0.5 * side, 0.998])
    pixels = np.zeros((texels, texels, 3), np.float32)
    pixels[row, column] = radiance
    spotted = Material("panel", Channel.of(0.0), Channel(texture=Texture("spot", pixels)))
    walls = [build.cube("room", 1.0, inward=True), quad("panel", corner, (side, 0, 0), (0, side, 0), 1)]
    texel = side / texels
    spot = quad("spot", corner + np.float32([column * texel, row * texel, -1e-3]), (texel, 0, 0), (0, texel, 0), 2)
    grey, black = build.material("wall", 0.6), build.material("black", 0.0)
    volumes = [build.volume(**volume_options)]
    return (build.scene(walls, [grey, spotted], volumes=volumes, name="spotted_room"),
            build.scene([*walls, spot], [grey, black, build.material("spot", 0.0, radiance)], volumes=volumes, name="spot_room"))


def many_lamps(count=30, albedo=0.6, seed=7, **volume_options):
    """A closed box with ``count`` coloured point lamps of very different strength, and a block that shades some from others."""
    rng = np.random.default_rng(seed)
    lamps = [build.point_light(rng.uniform(-0.9, 0.9, 3) * [1, 1, 0.3] + [0, 0, 0.6], 0.05 * 20 ** rng.random() * rng.random(3))
             for _ in range(count)]
    block = moved(build.cube("block", 0.25), (0.1, -0.1, -0.72))
    return build.scene([build.cube("room", 1.0, inward=True), block], [build.material("wall", albedo)], lamps,
                       volumes=[build.volume(**volume_options)], name="many_lamps")


def textured_room(**volume_options):
    """A box with a lamp and a floor of two saturated colours in large checks."""
    pixels = np.zeros((8, 8, 3), np.uint8)
    checks = (np.add.outer(np.arange(8), np.arange(8)) // 2) % 2 == 0
    pixels[checks], pixels[~checks] = (250, 60, 20), (10, 90, 240)
    texture = Texture("checks", pixels, srgb=True, interpolation="Closest")
    floor = quad("floor", (-1, -1, -0.999), (2, 0, 0), (0, 2, 0), 1)
    return build.scene([build.cube("room", 1.0, inward=True), floor],
                       [build.material("wall", 0.4), Material("checks", albedo=Channel(texture=texture))],
                       [build.point_light((0.3, -0.2, 0.2), 1.5)], volumes=[build.volume(**volume_options)], name="textured_room")


def screen_room(**volume_options):
    """A box in two halves with a lamp in one, joined through a sheet cut out by a chessboard of alpha that also glows faintly."""
    alpha = np.repeat((np.indices((6, 6)).sum(axis=0) % 2 == 0)[..., None], 4, axis=2).astype(np.float32)
    texture = Texture("holes", alpha, interpolation="Closest")
    screen = quad("screen", (0, -1, -1), (0, 2, 0), (0, 0, 2), 1)
    material = Material("screen", albedo=Channel.of(0.5), emission=Channel.of((0.0, 0.3, 0.0)),
                        alpha=Channel(texture=texture, texture_channel="a"), alpha_threshold=0.5)
    return build.scene([build.cube("room", 1.0, inward=True), screen], [build.material("wall", 0.6), material],
                       [build.point_light((-0.5, 0.1, 0.2), 1.0)], volumes=[build.volume(**volume_options)], name="screen_room")


def sunny_world(sun=400.0, size=(64, 32)):
    """A sky brighter towards the zenith, with a sun of a few texels: most of its light comes from them."""
    width, height = size
    v = (np.arange(height) + 0.5) / height
    pixels = np.broadcast_to((0.2 + 0.8 * v**2)[:, None, None] * np.float32([0.6, 0.8, 1.0]), (height, width, 3)).copy()
    pixels[22:24, 10:12] += np.float32([1.0, 0.9, 0.7]) * sun
    return World(pixels.astype(np.float32), description="sky with a sun")


def courtyard(world=None, **volume_options):
    """A ground plane with a block on it, under a sky with a small sun."""
    block = moved(build.cube("block", 0.5), (0.8, 0.0, 0.5))
    options = {"half_size": 0.6, "center": (-0.4, 0.0, 0.8)} | volume_options
    scene = build.scene([build.plane("ground", 4.0), block], [build.material("ground", 0.5)], volumes=[build.volume(**options)],
                        name="courtyard")
    return replace(scene, world=world or sunny_world())
