"""Scenes for reflections: what mirrors show, and what a picture alone cannot know of it."""

import bpy

from . import kit


def wet_floor():
    """A wet floor with pillars before a bright screen: its reflections show what is in the picture, what stands behind a pillar,
    and the lamp and the ceiling, which are beside the picture."""
    plaster = kit.material("Plaster", (0.55, 0.53, 0.5))
    kit.box("Ground", (-4.3, -3.3, -0.2), (4.3, 5.3, 0.0), kit.glossy("Wet Floor", (0.12, 0.11, 0.1), roughness=0.15))
    for name, low, high in (
            ("Wall West", (-4.2, -3.2, -0.1), (-4.0, 5.2, 3.1)), ("Wall East", (4.0, -3.2, -0.1), (4.2, 5.2, 3.1)),
            ("Wall North", (-4.1, 5.0, -0.1), (4.1, 5.2, 3.1)), ("Wall South", (-4.1, -3.2, -0.1), (4.1, -3.0, 3.1)),
            ("Ceiling", (-4.1, -3.1, 3.0), (4.1, 5.1, 3.2))):
        kit.box(name, low, high, plaster)
    colors = ((0.7, 0.25, 0.15), (0.2, 0.5, 0.3), (0.2, 0.3, 0.65), (0.7, 0.6, 0.2))
    for index, (x, y, color) in enumerate(zip((-2.4, -0.7, 1.2, 2.7), (2.2, 0.6, 1.6, 0.2), colors, strict=True)):
        name = f"Pillar {index + 1}"
        kit.box(name, (x - 0.16, y - 0.16, -0.05), (x + 0.16, y + 0.16, 3.05), kit.material(name, color), turn=0.4 * index)
    kit.box("Thin Pole", (0.28, 2.78, -0.05), (0.32, 2.82, 2.2), kit.material("Pole", (0.75, 0.75, 0.75)))
    screen = kit.material("Screen", 0.05, emission=(0.35, 0.6, 1.0), strength=1.6)
    kit.box("Screen", (-1.9, 4.9, 0.7), (1.9, 4.95, 2.6), screen)
    kit.lamp("Lamp", "AREA", (-1.5, -1.0, 2.95), 45.0, (1.0, 0.85, 0.6), shape="RECTANGLE", size=1.0, size_y=0.5)
    kit.probe_volume("Probes", (-4.0, -3.0, 0.0), (4.0, 5.0, 3.0), (12, 12, 5))
    kit.sphere_probe("Hall", (-4.0, -3.0, 0.0), (4.0, 5.0, 3.0))
    kit.camera((0.4, -2.7, 1.5), (0.0, 2.2, 0.75), lens=26.0)


def metal_shop():
    """Balls of steel, copper, plastic and lacquer, their roughness 0 to 1 by steps of a quarter, on a bench under a wide lamp."""
    walls = dict.fromkeys(("-y", "+y", "+z"), kit.material("Wall", (0.6, 0.58, 0.55))) | {
        "-x": kit.material("Red Wall", (0.6, 0.12, 0.1)), "+x": kit.material("Blue Wall", (0.12, 0.2, 0.6)),
        "-z": kit.material("Floor", (0.35, 0.33, 0.3))}
    kit.cavities("Shop", (-2.2, -2.2, -0.2), (2.2, 1.7, 2.4), [((-2.0, -2.0, 0.0), (2.0, 1.5, 2.2))], walls)
    kinds = (("Steel", (0.75, 0.75, 0.77), 1.0), ("Copper", (0.9, 0.5, 0.3), 1.0), ("Plastic", (0.1, 0.45, 0.2), 0.0),
             ("Lacquer", (0.04, 0.04, 0.05), 0.0))
    for row, (name, color, metallic) in enumerate(kinds):
        for step in range(5):
            roughness = 0.25 * step
            material = kit.glossy(f"{name} {roughness:.2f}", color, roughness, metallic)
            ball(f"{name} {step + 1}", (-1.3 + 0.65 * step, 0.9 - 0.6 * row, 0.66 - 0.16 * row), 0.24, material)
        kit.box(f"Bench {row + 1}", (-1.7, 0.62 - 0.6 * row, -0.05), (1.7, 1.2 - 0.6 * row, 0.42 - 0.16 * row),
                kit.glossy(f"Bench {row + 1}", (0.3, 0.22, 0.15), 0.5))
    kit.lamp("Ceiling Lamp", "AREA", (0.5, -0.4, 2.15), 60.0, (1.0, 0.95, 0.85), shape="RECTANGLE", size=1.2, size_y=0.4)
    kit.lamp("Bulb", "POINT", (-1.4, -1.2, 1.7), 12.0, (0.7, 0.85, 1.0), shadow_soft_size=0.08)
    kit.probe_volume("Probes", (-2.0, -2.0, 0.0), (2.0, 1.5, 2.2), (10, 9, 6))
    kit.sphere_probe("Shop", (-2.0, -2.0, 0.0), (2.0, 1.5, 2.2))
    kit.camera((0.0, -1.95, 1.55), (0.0, 0.1, 0.3), lens=19.0)


def ball(name: str, centre, radius: float, material: bpy.types.Material) -> bpy.types.Object:
    """A smooth sphere of ``radius`` about ``centre`` from a cube, 1,536 triangles."""
    low, high = (tuple(c + sign * radius for c in centre) for sign in (-1.0, 1.0))
    obj = kit.box(name, low, high, material)
    subdivide = obj.modifiers.new("Subdivide", "SUBSURF")
    subdivide.subdivision_type, subdivide.levels, subdivide.render_levels = "SIMPLE", 4, 4
    cast = obj.modifiers.new("Onto the Sphere", "CAST")
    cast.cast_type, cast.factor, cast.use_radius_as_size, cast.size = "SPHERE", 1.0, False, radius
    for polygon in obj.data.polygons:
        polygon.use_smooth = True
    return obj
