"""Rooms: scenes with an exact answer, or where a leak shows."""

import math

import bpy
import numpy as np

from . import kit

# The Cornell box as measured at Cornell University [mm]; one unit there is this many metres here (556 mm become 2 m).
CORNELL_SCALE = 2.0 / 556.0


def cornell_box():
    """The classic for colour bleeding: measured walls and blocks, open towards the viewer, one area lamp."""
    white = kit.material("White", (0.73, 0.73, 0.73))
    red = kit.material("Red", (0.61, 0.06, 0.05))
    green = kit.material("Green", (0.13, 0.45, 0.09))

    def place(x, height, depth):
        return (np.array((278.0 - x, depth, height)) * CORNELL_SCALE).tolist()

    corners = [place(x, height, depth) for x, height, depth in (
        (556, 0, 0), (0, 0, 0), (556, 0, 559.2), (0, 0, 559.2),
        (556, 548.8, 0), (0, 548.8, 0), (556, 548.8, 559.2), (0, 548.8, 559.2))]
    inward = [tuple(reversed(face)) for side, face in kit.BOX_FACES.items() if side != "-y"]
    order = [side for side in kit.BOX_FACES if side != "-y"]
    index = [{"-x": 1, "+x": 2}.get(side, 0) for side in order]
    kit.mesh_object("Room", corners, inward, [white, red, green], index)
    blocks = {
        "Short Block": (165.0, ((130, 65), (82, 225), (240, 272), (290, 114))),
        "Tall Block": (330.0, ((423, 247), (265, 296), (314, 456), (472, 406))),
    }
    for name, (height, footprint) in blocks.items():
        ring = [place(x, 0, depth) for x, depth in footprint]
        top = [place(x, height, depth) for x, depth in footprint]
        sides = [(i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4)]
        obj = kit.mesh_object(name, ring + top, [(3, 2, 1, 0), (4, 5, 6, 7), *sides], white)
        make_outward(obj)
    centre = place(278, 548.8, 279.5)
    kit.lamp("Ceiling Lamp", "AREA", (centre[0], centre[1], centre[2] - 0.004), 22.0, (1.0, 0.78, 0.5),
             shape="RECTANGLE", size=130 * CORNELL_SCALE, size_y=105 * CORNELL_SCALE)
    kit.probe_volume("Probes", (-1.0, 0.0, 0.0), (1.0, 2.0, 1.97), (4, 4, 4))
    kit.camera(place(278, 273, -800), place(278, 273, 0), lens=35.0 * 36.0 / 25.0, resolution=(480, 480))


def furnace():
    """A closed box whose walls emit and reflect the same everywhere: every direction sees L = Le / (1 − ρ) = 0.2 / 0.4."""
    wall = kit.material("Furnace", 0.6, emission=(1.0, 1.0, 1.0), strength=0.2)
    faces = [tuple(reversed(face)) for face in kit.BOX_FACES.values()]
    kit.mesh_object("Furnace", kit.box_vertices((-1, -1, 0), (1, 1, 2)), faces, wall)
    kit.probe_volume("Probes", (-1, -1, 0), (1, 1, 2), (3, 3, 3))
    kit.camera((-0.8, -0.8, 1.6), (0.5, 0.5, 0.8))


def integrating_sphere():
    """A sphere with a lamp off its centre: indirect irradiance is the same everywhere on the wall,
    E = Φ / (4πR²) · ρ / (1 − ρ), once for each channel of the albedo."""
    wall = kit.material("Coating", (0.8, 0.5, 0.2), shader="diffuse")
    obj = kit.mesh_object("Sphere", kit.box_vertices((-1, -1, -1), (1, 1, 1)),
                          [tuple(reversed(face)) for face in kit.BOX_FACES.values()], wall)
    subdivide = obj.modifiers.new("Subdivide", "SUBSURF")
    subdivide.subdivision_type, subdivide.levels, subdivide.render_levels = "SIMPLE", 6, 6
    cast = obj.modifiers.new("Onto the Sphere", "CAST")
    cast.cast_type, cast.factor, cast.use_radius_as_size, cast.size = "SPHERE", 1.0, False, 1.0
    kit.lamp("Lamp", "POINT", (0.3, 0.2, 0.4), 10.0, shadow_soft_size=0.02)
    kit.probe_volume("Probes", (-0.6, -0.6, -0.6), (0.6, 0.6, 0.6), (3, 3, 3))
    kit.camera((-0.7, -0.5, 0.1), (0.6, 0.4, -0.1), lens=18.0)


def two_rooms():
    """Two sealed rooms that share a wall of 4 cm, one lit and one black: whatever a probe in the dark one sees has leaked."""
    plaster = kit.material("Plaster", (0.75, 0.72, 0.68))
    floor = kit.material("Floor", (0.45, 0.30, 0.2))
    kit.cavities("Rooms", (-3.04, -1.54, -0.04), (3.04, 1.54, 2.54),
                 [((-3.0, -1.5, 0.0), (-0.02, 1.5, 2.5)), ((0.02, -1.5, 0.0), (3.0, 1.5, 2.5))],
                 dict.fromkeys(("-x", "+x", "-y", "+y", "+z"), plaster) | {"-z": floor})
    kit.box("Cabinet", (-2.98, -0.4, 0.001), (-2.4, 0.5, 0.9), kit.material("Cabinet", (0.15, 0.35, 0.55)))
    kit.box("Unlit Crate", (1.6, 0.3, 0.001), (2.3, 1.0, 0.7), plaster, turn=0.4)
    kit.lamp("Lamp", "POINT", (-1.2, -0.3, 2.1), 38.0, (1.0, 0.9, 0.75), shadow_soft_size=0.05)
    kit.probe_volume("Probes", (-3.0, -1.5, 0.0), (3.0, 1.5, 2.5), (8, 4, 3))
    kit.camera((-0.2, -1.35, 1.7), (-2.3, 0.6, 0.9), lens=20.0)


def corridor_door_ajar():
    """A bright room, a dark corridor and a door ajar by 28 degrees: nearly all light in the corridor has come through a
    narrow gap, over floor and ceiling that run on under the wall."""
    plaster = kit.material("Plaster", (0.7, 0.7, 0.68))
    floor = kit.material("Floor", (0.35, 0.24, 0.16))
    door = kit.material("Door", (0.55, 0.42, 0.3))
    # Slabs reach into one another at the corners, so no ray finds a seam.
    kit.box("Floor", (-3.1, -1.3, -0.1), (3.1, 4.1, 0.0), floor)
    kit.box("Ceiling", (-3.1, -1.3, 2.5), (3.1, 4.1, 2.6), plaster)
    for name, low, high in (
            ("Wall West", (-3.1, -1.3, -0.05), (-3.0, 4.1, 2.55)), ("Wall East", (3.0, -1.3, -0.05), (3.1, 4.1, 2.55)),
            ("Wall South", (-3.05, -1.3, -0.05), (3.05, -1.2, 2.55)), ("Wall North", (-3.05, 4.0, -0.05), (3.05, 4.1, 2.55)),
            ("Partition West", (-3.05, 0.0, -0.05), (-0.45, 0.1, 2.55)),
            ("Partition East", (0.45, 0.0, -0.05), (3.05, 0.1, 2.55)),
            ("Lintel", (-0.5, 0.001, 2.05), (0.5, 0.099, 2.55))):
        kit.box(name, low, high, plaster)
    leaf = kit.mesh_object("Door", kit.box_vertices((0.0, -0.02, 0.005), (0.89, 0.02, 2.04)), kit.BOX_FACES.values(), door)
    leaf.location, leaf.rotation_euler = (-0.445, 0.05, 0.0), (0.0, 0.0, math.radians(28.0))
    kit.lamp("Room Lamp", "AREA", (0.4, 2.0, 2.45), 500.0, (1.0, 0.92, 0.8), shape="DISK", size=0.6)
    kit.probe_volume("Probes", (-3.0, -1.2, 0.0), (3.0, 4.0, 2.5), (8, 7, 3))
    kit.camera((2.4, -1.0, 1.6), (-0.6, 0.05, 1.1), lens=20.0)


def make_outward(obj: bpy.types.Object) -> None:
    """Turn every face of a closed mesh outwards."""
    import bmesh
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    bmesh.ops.recalc_face_normals(mesh, faces=mesh.faces[:])
    mesh.to_mesh(obj.data)
    mesh.free()
