"""A two-storey court of arcades: the big sample, made big by modifiers and instances so that the file stays small."""

import math

import bpy
import numpy as np
from mathutils import Matrix

from . import kit

STOREY = 3.8  # floor to floor [m]; a bay is 3.6 m high and stands on a slab of 0.2 m
COURT = (6.0, 4.0)  # half sizes of the open court [m], whole numbers of bays
BAY = 2.0  # width of a bay [m]
GALLERY = 2.4  # depth of the gallery behind the columns [m]


def atrium():
    """Arcades, columns and cloth on two floors under sun and a graded sky: over 250,000 triangles through subdivision, array,
    solidify, nested collection instances and geometry nodes, with packed textures."""
    stone, plaster, tiles = textured_materials()
    gradient_sky()
    kit.lamp("Sun", "SUN", (4.0, -5.0, 14.0), 14.0, (1.0, 0.94, 0.85), target=(-1.2, 1.5, 0.0), angle=math.radians(0.53))
    masonry(stone, plaster, tiles)
    place_bays(stone)
    hang_cloth()
    scatter_pebbles(kit.material("Pebbles", (0.5, 0.48, 0.45)))
    kit.probe_volume("Probes", (-8.2, -6.2, 0.1), (8.2, 6.2, 7.3), (12, 9, 6))
    kit.camera((-5.4, -2.6, 1.8), (2.6, 1.3, 3.0), lens=18.0)


def textured_materials():
    """Stone, painted plaster and floor tiles, each with a small generated picture."""
    rng = np.random.default_rng(7)
    y, x = np.mgrid[0:64, 0:64]
    course, joint = y // 16, (y % 16 < 1) | ((x + 16 * ((y // 16) % 2)) % 32 < 1)
    grain = 0.04 * rng.standard_normal((64, 64, 1))
    block = rng.uniform(-0.05, 0.05, (4, 2))[course, ((x + 16 * (course % 2)) // 32) % 2][..., None]
    stone = np.clip(np.array((0.80, 0.73, 0.61)) + block + grain - 0.18 * joint[..., None], 0, 1)
    band = ((y > 6) & (y < 18))[..., None]
    plaster = np.clip(np.where(band, (0.66, 0.33, 0.24), (0.86, 0.80, 0.68)) + grain / 2, 0, 1)
    checker = (((x // 32) + (y // 32)) % 2 == 0)[..., None]
    tiles = np.clip(np.where(checker, (0.74, 0.70, 0.64), (0.42, 0.30, 0.26)) + grain / 2, 0, 1)
    return tuple(kit.material(name, 0.8, image=kit.picture(f"{name}.png", pixels))
                 for name, pixels in (("Stone", stone), ("Plaster", plaster), ("Tiles", tiles)))


def gradient_sky() -> None:
    """Surround the scene with a small equirectangular picture: blue above, pale at the horizon, dim earth below."""
    elevation = (np.arange(32) + 0.5) / 32 * math.pi - math.pi / 2
    height = np.clip(np.sin(elevation), 0, 1)[:, None]
    sky = (1 - height) * np.array((1.1, 1.15, 1.2)) + height * np.array((0.28, 0.5, 1.0))
    rows = np.where(elevation[:, None] > 0, sky, np.array((0.16, 0.14, 0.12)))
    image = kit.picture("sky.exr", np.broadcast_to(rows[:, None], (32, 64, 3)), floating=True)
    kit.world_image(bpy.context.scene, image, 1.2)


def masonry(stone, plaster, tiles) -> None:
    """Floors, roof and outer walls: boxes that reach into or touch one another, yet no two show a face in one and the same place.

    What lies twice in a plane has no right picture: in Cycles each of the two shadows the other as rounding has it.
    """
    x, y = COURT
    outer_x, outer_y = x + GALLERY, y + GALLERY
    top = 2 * STOREY
    kit.cube_uvs(kit.box("Ground", (-outer_x - 0.4, -outer_y - 0.4, -0.4), (outer_x + 0.4, outer_y + 0.4, 0.0), tiles), 1.6)
    for name, low, high in (
            ("Wall West", (-outer_x - 0.3, -outer_y - 0.15), (-outer_x, outer_y + 0.15)),
            ("Wall East", (outer_x, -outer_y - 0.15), (outer_x + 0.3, outer_y + 0.15)),
            ("Wall South", (-outer_x - 0.1, -outer_y - 0.3), (outer_x + 0.1, -outer_y)),
            ("Wall North", (-outer_x - 0.1, outer_y), (outer_x + 0.1, outer_y + 0.3))):
        kit.cube_uvs(kit.box(name, (*low, -0.2), (*high, top - 0.1), plaster), STOREY)
    for level, (low_z, high_z, coat) in enumerate(((STOREY - 0.2, STOREY, tiles), (top - 0.2, top, stone)), 1):
        for name, low, high in (
                ("West", (-outer_x - 0.2, -outer_y - 0.2), (-x + 0.2, outer_y + 0.2)),
                ("East", (x - 0.2, -outer_y - 0.2), (outer_x + 0.2, outer_y + 0.2)),
                ("South", (0.2 - x, -outer_y - 0.2), (x - 0.2, 0.2 - y)), ("North", (0.2 - x, y - 0.2), (x - 0.2, outer_y + 0.2))):
            kit.cube_uvs(kit.box(f"Slab {level} {name}", (*low, low_z), (*high, high_z), coat), 1.6)
    for i, (sign_x, sign_y) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1)), 1):
        low = (sign_x * x - 0.26, sign_y * y - 0.26, -0.1)
        kit.cube_uvs(kit.box(f"Corner Pier {i}", low, (sign_x * x + 0.26, sign_y * y + 0.26, top - 0.1), stone))


def lathe(name: str, profile, segments: int, coat) -> bpy.types.Object:
    """A closed solid of revolution about Z from ``profile`` [(radius, z), …] given from the bottom up; not yet linked."""
    angle = 2 * math.pi * np.arange(segments) / segments
    rings = [np.stack((radius * np.cos(angle), radius * np.sin(angle), np.full(segments, z)), axis=1) for radius, z in profile]
    i, j = np.meshgrid(np.arange(len(profile) - 1), np.arange(segments), indexing="ij")
    following = (j + 1) % segments
    sides = np.stack((i * segments + j, i * segments + following, (i + 1) * segments + following, (i + 1) * segments + j), -1)
    caps = [tuple(reversed(range(segments))), tuple(range((len(profile) - 1) * segments, len(profile) * segments))]
    obj = kit.mesh_object(name, np.concatenate(rings), [*sides.reshape(-1, 4).tolist(), *caps], coat)
    kit.cube_uvs(obj)
    return obj


def move_to(collection: bpy.types.Collection, *objects) -> None:
    """Take ``objects`` out of the scene's own collection: they show only through instances of ``collection``."""
    for obj in objects:
        bpy.context.scene.collection.objects.unlink(obj)
        collection.objects.link(obj)


def subdivide(obj: bpy.types.Object, levels: int) -> None:
    """Add a Catmull-Clark modifier."""
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = levels


def arcade_bay(stone) -> bpy.types.Collection:
    """One bay at the origin: half of a pair of columns and the round arch between them, x from −1 to 1, z from 0 to 3.6."""
    shaft = [(0.20, 0.18), (0.20, 0.22), (0.165, 0.26), (0.165, 0.34), (0.163, 0.8), (0.157, 1.3), (0.148, 1.8), (0.142, 2.1),
             (0.16, 2.13), (0.16, 2.17), (0.2, 2.26), (0.2, 2.3)]
    column = lathe("Column", shaft, 24, stone)
    subdivide(column, 1)
    base = kit.cube_uvs(kit.box("Base", (-0.24, -0.24, 0.0), (0.24, 0.24, 0.2), stone))
    capital = kit.cube_uvs(kit.box("Capital", (-0.25, -0.25, 2.28), (0.25, 0.25, 2.42), stone))
    for obj in (column, base, capital):
        obj.location.x -= BAY / 2
    angle = np.linspace(math.pi, 0, 33)
    below = np.concatenate(([(-1, 2.4)], np.stack((0.75 * np.cos(angle), 2.4 + 0.75 * np.sin(angle)), 1), [(1, 2.4)]))
    above = np.stack((below[:, 0], np.full(len(below), 3.6)), axis=1)
    flat = np.concatenate((below, above))
    n = len(below)
    arch = kit.mesh_object("Arch", np.insert(flat, 1, 0.0, axis=1), [(i, i + 1, n + i + 1, n + i) for i in range(n - 1)], stone)
    kit.cube_uvs(arch)
    solidify = arch.modifiers.new("Thickness", "SOLIDIFY")
    solidify.thickness, solidify.offset = 0.4, 0.0
    bay = bpy.data.collections.new("Bay")
    move_to(bay, column, base, capital, arch)
    return bay


def balustrade(stone) -> bpy.types.Collection:
    """A rail on turned balusters for one bay: one baluster, subdivided and arrayed."""
    turned = lathe("Baluster", [(0.06, 0.0), (0.06, 0.1), (0.03, 0.16), (0.055, 0.35), (0.065, 0.45), (0.03, 0.68), (0.06, 0.76),
                                (0.06, 0.86)], 14, stone)
    turned.location.x = -0.7
    subdivide(turned, 1)
    array = turned.modifiers.new("Row", "ARRAY")
    array.count, array.use_relative_offset, array.use_constant_offset = 6, False, True
    array.constant_offset_displace = (0.28, 0.0, 0.0)
    rail = kit.cube_uvs(kit.box("Rail", (-0.87, -0.09, 0.84), (0.87, 0.09, 0.95), stone))
    collection = bpy.data.collections.new("Balustrade")
    move_to(collection, turned, rail)
    return collection


def place_bays(stone) -> None:
    """Line both storeys of the court with bays; the upper bay nests the lower one and adds its balustrade."""
    lower = arcade_bay(stone)
    upper = bpy.data.collections.new("Upper Bay")
    for collection in (lower, balustrade(stone)):
        nested = bpy.data.objects.new(f"{collection.name} in Upper Bay", None)
        nested.instance_type, nested.instance_collection = "COLLECTION", collection
        kit.link(nested, upper)
    x, y = COURT
    sides = {"South": (x, y, 0.0), "East": (y, x, math.pi / 2), "North": (x, y, math.pi), "West": (y, x, -math.pi / 2)}
    for level, collection in enumerate((lower, upper)):
        for side, (half, distance, turn) in sides.items():
            for i in range(round(2 * half / BAY)):
                local = Matrix.Translation((-half + BAY * (i + 0.5), -distance, level * STOREY))
                kit.instance(f"{collection.name} {side} {i + 1}", collection, Matrix.Rotation(turn, 4, "Z") @ local)


def hang_cloth() -> None:
    """Six long banners of one subdivided sheet, hung in the court, coloured by object rather than by mesh."""
    columns, rows = 20, 44
    v, u = np.mgrid[0:rows + 1, 0:columns + 1]
    u, v = u / columns, v / rows
    sway = 0.09 * np.sin(2 * math.pi * (2.5 * u + 0.25 * v)) * (0.25 + 0.75 * (1 - v)) + 0.05 * np.sin(5.0 * v)
    points = np.stack((1.3 * (u - 0.5), sway, 4.6 * (v - 1.0)), axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    corner = i * (columns + 1) + j
    faces = np.stack((corner, corner + 1, corner + columns + 2, corner + columns + 1), axis=-1).reshape(-1, 4)
    corners = np.stack((u, v), axis=-1).reshape(-1, 2)[faces.ravel()]
    y, x = np.mgrid[0:32, 0:32]
    weave = (0.85 + 0.15 * (((x // 2) + (y // 2)) % 2))[..., None] * np.where(((x < 3) | (x > 28))[..., None], 0.55, 1.0)
    coats = [kit.material(f"Cloth {name}", 0.5, image=kit.picture(f"cloth_{name.lower()}.png", weave * np.array(color)))
             for name, color in (("Red", (0.78, 0.22, 0.18)), ("Green", (0.28, 0.58, 0.25)), ("Blue", (0.25, 0.36, 0.75)))]
    first = kit.mesh_object("Banner 1", points, faces, coats[0], uvs=corners)
    first.data.name = "Banner"
    first.data.shade_smooth()
    subdivide(first, 1)
    for number in range(6):
        obj = first if number == 0 else kit.link(first.copy())
        obj.name = f"Banner {number + 1}"
        obj.location = (-3.0 + 3.0 * (number % 3), -3.6 if number < 3 else 3.6, 7.0)
        obj.rotation_euler.z = 0.15 * number
        obj.material_slots[0].link = "OBJECT"
        obj.material_slots[0].material = coats[number % 3]


def scatter_pebbles(coat) -> None:
    """A bed of pebbles in the middle of the court: one icosphere on every point of a jittered grid, by geometry nodes."""
    rng = np.random.default_rng(11)
    y, x = np.mgrid[-1.0:1.0:9j, -2.0:2.0:17j]
    points = np.stack((x.ravel(), y.ravel(), np.full(x.size, 0.05)), axis=1)
    points[:, :2] += rng.uniform(-0.07, 0.07, (len(points), 2))
    obj = kit.mesh_object("Pebbles", points, [], coat)
    tree = bpy.data.node_groups.new("Pebbles", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    given, made = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    sphere, paint = tree.nodes.new("GeometryNodeMeshIcoSphere"), tree.nodes.new("GeometryNodeSetMaterial")
    scatter, size = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("FunctionNodeRandomValue")
    sphere.inputs["Radius"].default_value, sphere.inputs["Subdivisions"].default_value = 0.1, 3
    paint.inputs["Material"].default_value = coat
    size.data_type = "FLOAT"
    next(item for item in size.inputs if item.name == "Min" and item.type == "VALUE").default_value = 0.6
    next(item for item in size.inputs if item.name == "Max" and item.type == "VALUE").default_value = 1.3
    tree.links.new(given.outputs[0], scatter.inputs["Points"])
    tree.links.new(sphere.outputs["Mesh"], paint.inputs["Geometry"])
    tree.links.new(paint.outputs["Geometry"], scatter.inputs["Instance"])
    tree.links.new(next(item for item in size.outputs if item.type == "VALUE"), scatter.inputs["Scale"])
    tree.links.new(scatter.outputs["Instances"], made.inputs[0])
    obj.modifiers.new("Scatter", "NODES").node_group = tree
