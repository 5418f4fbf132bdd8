"""A narrow street in strong colours, for pictures in a style: walls that tint what stands beside them, round and square things,
overlaps near and far, edges marked by hand, a colour of its own for each material's lines."""

import math

import bpy
import numpy as np

from . import kit


def _paint(name: str, albedo, line=None):
    """A Lambertian material whose Line Art colour is a dark shade of it."""
    made = kit.material(name, albedo)
    shade = np.asarray(albedo) * 0.12 if line is None else line
    made.line_color = (*map(float, shade), 1.0)
    return made


def _smooth(obj: bpy.types.Object) -> bpy.types.Object:
    obj.data.polygons.foreach_set("use_smooth", np.ones(len(obj.data.polygons), bool))
    return obj


def _turned(name: str, profile, coat, sides: int = 40, at=(0.0, 0.0, 0.0), smooth: bool = True) -> bpy.types.Object:
    """A surface of revolution from ``profile``, (radius, height) from the foot up, smooth but at corners, at ``at``."""
    angle = np.arange(sides) * 2 * math.pi / sides
    points = [(radius * math.cos(a), radius * math.sin(a), height) for radius, height in profile for a in angle]
    faces = [(ring * sides + k, ring * sides + (k + 1) % sides, (ring + 1) * sides + (k + 1) % sides, (ring + 1) * sides + k)
             for ring in range(len(profile) - 1) for k in range(sides)]
    faces += [tuple(reversed(range(sides))), tuple(range((len(profile) - 1) * sides, len(profile) * sides))]
    obj = kit.mesh_object(name, points, faces, coat)
    obj.location = at
    if smooth:
        _smooth(obj)
        corners = np.empty(len(obj.data.edges) * 2, np.int32)
        obj.data.edges.foreach_get("vertices", corners)
        rings = corners.reshape(-1, 2) // sides
        sharp = (rings[:, 0] == rings[:, 1]) & np.isin(rings[:, 0], _corners(profile))
        obj.data.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data.foreach_set("value", sharp)
    return obj


def _corners(profile) -> list[int]:
    """The rings at which a profile bends by more than 35 degrees, both ends among them."""
    way = np.diff(np.asarray(profile, float), axis=0)
    turn = np.arctan2(way[:, 1], way[:, 0])
    return [0, len(profile) - 1, *(k + 1 for k in range(len(turn) - 1) if abs(turn[k + 1] - turn[k]) > math.radians(35))]


def _ball(name: str, at, radius: float, coat, squash: float = 1.0) -> bpy.types.Object:
    steps = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 22)[1:-1]
    return _turned(name, [(radius * math.cos(a), squash * radius * math.sin(a)) for a in steps], coat, 44, at)


def _mark(obj: bpy.types.Object, chosen) -> None:
    """Mark the edges of ``obj`` between corners a and b, for which ``chosen(a, b)`` holds, for Freestyle."""
    mesh = obj.data
    marks = [bool(chosen(*(np.array(mesh.vertices[index].co) for index in edge.vertices))) for edge in mesh.edges]
    if "use_freestyle_mark" in bpy.types.MeshEdge.bl_rna.properties:
        mesh.edges.foreach_set("use_freestyle_mark", marks)
    else:
        mesh.attributes.new("freestyle_edge", "BOOLEAN", "EDGE").data.foreach_set("value", marks)


def _window(name: str, side: float, y: float, z: float, frame, glass, shutter) -> None:
    """A window with shutters in the wall whose face is at x = ``side``, towards the street."""
    inward = -math.copysign(1.0, side)
    for part, low, high, coat in (
            ("glass", (0.0, y - 0.38, z), (0.03, y + 0.38, z + 1.1), glass),
            ("sill", (0.0, y - 0.5, z - 0.1), (0.16, y + 0.5, z), frame),
            ("head", (0.0, y - 0.46, z + 1.1), (0.1, y + 0.46, z + 1.2), frame),
            ("bar", (0.0, y - 0.03, z), (0.06, y + 0.03, z + 1.1), frame),
            ("left shutter", (0.0, y - 0.82, z - 0.02), (0.07, y - 0.42, z + 1.14), shutter),
            ("right shutter", (0.0, y + 0.42, z - 0.02), (0.07, y + 0.82, z + 1.14), shutter)):
        ends = sorted((side + inward * low[0], side + inward * high[0]))
        kit.box(f"{name} {part}", (ends[0], *low[1:]), (ends[1], *high[1:]), coat)


def _awning(name: str, side: float, y: float, z: float, coats) -> None:
    """A striped roof of cloth over a shop at x = ``side``."""
    inward, stripes, width, depth = -math.copysign(1.0, side), 8, 2.4, 1.0
    edge = np.linspace(y - width / 2, y + width / 2, stripes + 1)
    points, faces = [], []
    for k in range(stripes + 1):
        outer = side + inward * depth
        points += [(side, edge[k], z + 0.62), (outer, edge[k], z + 0.12), (outer, edge[k], z - 0.12)]
    for k in range(stripes):
        a, b = 3 * k, 3 * (k + 1)
        faces += [(a, a + 1, b + 1, b), (a + 1, a + 2, b + 2, b + 1)]
    kit.mesh_object(name, points, faces, coats, [k // 2 % 2 for k in range(2 * stripes)])


def toon_street():
    """A street between a red and a cream house in low sun: the red house's shadow side reddens barrels, crates and cobbles."""
    red, cream = _paint("Red Plaster", (0.62, 0.13, 0.07)), _paint("Cream Plaster", (0.78, 0.62, 0.38))
    teal, white = _paint("Teal Shutter", (0.05, 0.32, 0.33)), _paint("White Paint", (0.8, 0.78, 0.74))
    glass, slate = _paint("Window", (0.05, 0.09, 0.16)), _paint("Slate", (0.12, 0.14, 0.22))
    stone, paving = _paint("Stone", (0.42, 0.4, 0.38)), _paint("Paving", (0.5, 0.46, 0.4))
    wood, leaf = _paint("Wood", (0.34, 0.17, 0.07)), _paint("Leaves", (0.1, 0.33, 0.08))
    iron, yellow = _paint("Iron", (0.05, 0.05, 0.06)), _paint("Yellow Cloth", (0.85, 0.55, 0.06))
    clay, lilac = _paint("Clay", (0.5, 0.2, 0.1)), _paint("Lilac Plaster", (0.42, 0.34, 0.6))
    scene = bpy.context.scene
    kit.world(scene, (0.35, 0.58, 1.0), 0.9)
    kit.box("Ground", (-14.0, -8.0, -0.4), (14.0, 40.0, 0.0), paving)
    for side, coat, name in ((-1, red, "Red House"), (1, cream, "Cream House")):
        inner, outer = side * 2.6, side * 8.0
        low, high = sorted((inner, outer))
        kit.box(name, (low, -7.5, -0.1), (high, 7.0, 6.2), coat)
        low, high = sorted((side * 2.2, side * 8.2))
        kit.box(f"{name} Eaves", (low, -7.6, 6.2), (high, 7.2, 6.5), white)
        kit.box(f"{name} Roof", (low + 0.2, -7.4, 6.5), (high - 0.2, 7.0, 8.0), slate)
        low, high = sorted((side * 1.75, side * 2.62))
        kit.box(f"{name} Pavement", (low, -7.5, -0.1), (high, 7.0, 0.12), stone)
        for k, y in enumerate((-4.2, -1.4, 1.4, 4.2)):
            _window(f"{name} Window {k}", inner, y, 3.6, white, glass, teal if side > 0 else cream)
        for k, y in enumerate((-1.3, 3.4) if side < 0 else (0.4,)):
            _window(f"{name} Lower Window {k}", inner, y, 1.1, white, glass, teal if side > 0 else cream)
    kit.box("Red Door", (-2.6, 0.55, 0.1), (-2.52, 1.65, 2.35), teal)
    kit.box("Red Door Step", (-2.62, 0.4, 0.0), (-2.1, 1.8, 0.28), stone)
    kit.box("Cream Door", (2.52, 3.3, 0.1), (2.6, 4.4, 2.3), red)
    _awning("Awning", 2.6, 0.4, 2.85, [yellow, white])
    # What closes the street: an arch of a lilac house, a tower, a hill.
    kit.box("Lilac House West", (-8.0, 11.0, -0.1), (-1.3, 15.0, 2.9), lilac)
    kit.box("Lilac House East", (1.3, 11.0, -0.1), (8.0, 15.0, 2.9), lilac)
    kit.box("Lilac House Top", (-8.2, 10.85, 2.9), (8.2, 15.2, 5.6), lilac)
    kit.box("Lilac Roof", (-8.4, 10.6, 5.6), (8.4, 15.4, 5.9), slate)
    for k, x in enumerate((-2.6, 0.0, 2.6)):
        kit.box(f"Lilac Window {k}", (x - 0.4, 10.8, 3.5), (x + 0.4, 10.85, 4.7), glass)
    kit.box("Tower", (-2.2, 19.0, -0.1), (1.2, 22.4, 10.5), cream)
    _turned("Tower Roof", [(2.5, 10.5), (2.2, 10.7), (0.05, 14.4)], slate, 4, (-0.5, 20.7, 0.0), smooth=False)
    clock = _turned("Clock", [(0.95, 0.0), (0.95, 0.12)], white, 48)
    clock.location, clock.rotation_euler = (-0.5, 19.0, 8.6), (math.pi / 2, 0.0, 0.0)
    for name, low, high in (("Hour Hand", (-0.56, 18.8, 8.6), (-0.44, 18.86, 9.15)),
                            ("Minute Hand", (-0.5, 18.8, 8.55), (0.2, 18.86, 8.65))):
        kit.box(name, low, high, iron)
    _ball("Hill", (-9.0, 52.0, -14.0), 24.0, leaf, 0.95)
    # What stands in the street.
    barrel = [(0.3, 0.0), (0.36, 0.14), (0.41, 0.3), (0.43, 0.46), (0.41, 0.62), (0.36, 0.78), (0.3, 0.92), (0.26, 0.92),
              (0.26, 0.86)]
    for k, (x, y) in enumerate(((-1.95, -2.3), (-2.1, -1.35), (-1.25, -2.0))):
        _turned(f"Barrel {k}", barrel, wood, 40, (x, y, 0.12 if x < -1.75 else 0.0))
        for z in (0.2, 0.68):
            _turned(f"Barrel {k} Hoop {z:.1f}", [(0.375, 0.0), (0.425, 0.0), (0.425, 0.06), (0.375, 0.06)], iron, 40,
                    (x, y, z + (0.12 if x < -1.75 else 0.0)))
    for k, (x, y, z, turn, size) in enumerate((
            (1.2, -1.6, 0.0, 0.3, 0.8), (1.75, -0.75, 0.12, -0.2, 0.7), (1.28, -1.52, 0.8, 0.75, 0.55))):
        half = 0.5 * size
        crate = kit.box(f"Crate {k}", (x - half, y - half, z), (x + half, y + half, z + size), clay if k == 1 else wood, turn)
        _mark(crate, lambda a, b: True)
    for k, (x, y, size) in enumerate(((1.95, 2.1, 0.62), (-2.0, 2.6, 0.52), (2.0, 5.4, 0.6))):
        _turned(f"Pot {k}", [(0.24, 0.0), (0.3, 0.4), (0.36, 0.42), (0.36, 0.52), (0.3, 0.52)], clay, 36, (x, y, 0.12))
        _turned(f"Stem {k}", [(0.04, 0.5), (0.04, 1.0)], wood, 16, (x, y, 0.12))
        _ball(f"Bush {k}", (x, y, 1.15 + size), size, leaf)
    _turned("Lamp Post", [(0.16, 0.0), (0.16, 0.3), (0.06, 0.42), (0.05, 3.0), (0.1, 3.05)], iron, 24, (-1.55, 4.6, 0.0))
    _ball("Lamp Globe", (-1.55, 4.6, 3.3), 0.28, white)
    _ball("Ball", (0.15, -2.4, 0.24), 0.24, red)
    sun = kit.lamp("Sun", "SUN", (5.0, -6.5, 7.2), 4.2, (1.0, 0.9, 0.72), target=(0.0, 0.0, 0.0), angle=0.0)
    sun.data.use_shadow = True
    kit.probe_volume("Probes", (-2.6, -7.0, 0.0), (2.6, 11.0, 6.0), (8, 20, 8))
    kit.camera((0.25, -7.2, 1.75), (-0.12, 2.0, 2.05), lens=24.0, resolution=(960, 540))
