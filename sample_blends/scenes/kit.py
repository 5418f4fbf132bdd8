"""Small parts that every sample is built from: meshes from arrays, Lambertian materials, lamps, volumes, cameras.

All lengths are metres, Z up. Lamps are hidden from the camera, because a probe does not see lamps directly: a render then
shows what a probe would see from the same point.
"""

import bpy
import numpy as np
from mathutils import Matrix, Vector

# The six faces of a box over its corners 0..7 (bit 0 = x, bit 1 = y, bit 2 = z), counter-clockwise seen from outside.
BOX_FACES = {
    "-x": (0, 4, 6, 2), "+x": (1, 3, 7, 5), "-y": (0, 1, 5, 4), "+y": (2, 6, 7, 3), "-z": (0, 2, 3, 1), "+z": (4, 5, 7, 6),
}


def reset(name: str) -> bpy.types.Scene:
    """Empty the file and return its scene, set up for Cycles on the CPU with a black world and the Standard view."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    for screen in bpy.data.screens:  # a file selector remembers the home folder of whoever builds the file
        for space in (space for area in screen.areas for space in area.spaces if space.type == "FILE_BROWSER"):
            if space.params is not None:
                space.params.directory = b"//"
    scene = bpy.context.scene
    scene.name = name
    scene.render.filepath = "//"
    scene.unit_settings.system = "METRIC"
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 640, 360
    scene.cycles.device = "CPU"
    scene.cycles.samples = 128
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 32
    scene.view_settings.view_transform = "Standard"
    world(scene, (0.0, 0.0, 0.0))
    return scene


def world(scene: bpy.types.Scene, color, strength: float = 1.0) -> bpy.types.World:
    """Give ``scene`` surroundings of one constant radiance ``color`` × ``strength`` [W·sr⁻¹·m⁻²]."""
    result = scene.world or bpy.data.worlds.new("World")
    scene.world = result
    if result.node_tree is None:  # from 5.0 on every world has nodes and the switch is deprecated
        result.use_nodes = True
    background = result.node_tree.nodes.get("Background")
    if background is None:
        background = result.node_tree.nodes.new("ShaderNodeBackground")
        output = result.node_tree.nodes.new("ShaderNodeOutputWorld")
        result.node_tree.links.new(background.outputs[0], output.inputs["Surface"])
    background.inputs["Color"].default_value = (*color, 1.0)
    background.inputs["Strength"].default_value = strength
    return result


def world_image(scene: bpy.types.Scene, image: bpy.types.Image, strength: float = 1.0, turn: float = 0.0) -> None:
    """Surround ``scene`` with an equirectangular ``image``, turned about Z by ``turn`` [rad]."""
    tree = world(scene, (0.0, 0.0, 0.0), strength).node_tree
    background = tree.nodes["Background"]
    environment = tree.nodes.new("ShaderNodeTexEnvironment")
    environment.image = image
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, turn)
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    tree.links.new(environment.outputs["Color"], background.inputs["Color"])


def material(name: str, albedo, emission=None, strength: float = 0.0, image: bpy.types.Image | None = None,
             shader: str = "principled") -> bpy.types.Material:
    """A Lambertian material: Principled without specular, or the plain Diffuse BSDF (``shader='diffuse'``).

    ``albedo`` is scalar or RGB, scene-linear; ``image`` replaces it by a texture over the active UV map. ``emission`` (RGB) ×
    ``strength`` is the radiance the surface adds.
    """
    result = bpy.data.materials.new(name)
    if result.node_tree is None:
        result.use_nodes = True
    tree = result.node_tree
    color = (*np.broadcast_to(np.asarray(albedo, float), (3,)), 1.0)
    result.diffuse_color = color
    if shader == "diffuse":
        tree.nodes.clear()
        bsdf = tree.nodes.new("ShaderNodeBsdfDiffuse")
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(bsdf.outputs[0], output.inputs["Surface"])
        target = bsdf.inputs["Color"]
    else:
        bsdf = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
        bsdf.inputs["Specular IOR Level"].default_value = 0.0
        bsdf.inputs["Roughness"].default_value = 1.0
        if emission is not None:
            bsdf.inputs["Emission Color"].default_value = (*emission, 1.0)
            bsdf.inputs["Emission Strength"].default_value = strength
        target = bsdf.inputs["Base Color"]
    target.default_value = color
    if image is not None:
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        tree.links.new(texture.outputs["Color"], target)
    return result


def glossy(name: str, color, roughness: float, metallic: float = 0.0) -> bpy.types.Material:
    """A Principled material with its layer: a metal, or a dielectric of Blender's default index."""
    result = material(name, color)
    bsdf = next(node for node in result.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for socket, value in (("Specular IOR Level", 0.5), ("Roughness", roughness), ("Metallic", metallic)):
        bsdf.inputs[socket].default_value = value
    return result


def picture(name: str, pixels: np.ndarray, floating: bool = False) -> bpy.types.Image:
    """A packed image from ``pixels`` (height, width, 3), row 0 at the bottom: sRGB-encoded 0–1, or linear floats."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, float_buffer=floating, alpha=False)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()
    return image


def mesh_object(name: str, vertices, faces, materials, face_material=None, uvs=None) -> bpy.types.Object:
    """An object from ``vertices`` (v, 3) and polygons ``faces``; ``materials`` is one or a list, picked per face by
    ``face_material``; ``uvs`` is one (u, v) per corner."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], [tuple(map(int, face)) for face in faces])
    for item in materials if isinstance(materials, (list, tuple)) else [materials]:
        mesh.materials.append(item)
    if face_material is not None:
        mesh.polygons.foreach_set("material_index", np.asarray(face_material, np.int32))
    if uvs is not None:
        mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", np.asarray(uvs, np.float32).ravel())
    mesh.update()
    return link(bpy.data.objects.new(name, mesh))


def link(obj: bpy.types.Object, collection: bpy.types.Collection | None = None) -> bpy.types.Object:
    """Put ``obj`` into ``collection`` (the scene's own by default) and return it."""
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def box_vertices(low, high) -> np.ndarray:
    """The 8 corners of an axis-aligned box in the order of ``BOX_FACES``."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    return np.where(bits == 1, high, low)


def box(name: str, low, high, material_, turn: float = 0.0, without=()) -> bpy.types.Object:
    """A closed box from ``low`` to ``high`` facing outwards, turned about its own vertical axis by ``turn`` [rad]; the faces
    named in ``without`` are left out."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    centre = (low + high) / 2
    faces = [face for side, face in BOX_FACES.items() if side not in without]
    obj = mesh_object(name, box_vertices(low - centre, high - centre), faces, material_)
    obj.location, obj.rotation_euler = centre, (0.0, 0.0, turn)
    return obj


def cavities(name: str, low, high, rooms, materials) -> bpy.types.Object:
    """A solid block from ``low`` to ``high`` with box-shaped cavities ``rooms`` [(low, high), …]: walls of real thickness,
    watertight, every normal pointing out of the solid. ``materials`` is a mapping of the faces' names to materials."""
    names = list(dict.fromkeys(materials.values()))
    vertices, faces, index = [box_vertices(low, high)], list(BOX_FACES.values()), [0] * 6
    for room_low, room_high in rooms:
        start = 8 * len(vertices)
        vertices.append(box_vertices(room_low, room_high))
        for side, face in BOX_FACES.items():
            faces.append(tuple(start + corner for corner in reversed(face)))
            index.append(names.index(materials[side]))
    return mesh_object(name, np.concatenate(vertices), faces, names, index)


def cube_uvs(obj: bpy.types.Object, metres: float = 1.0) -> bpy.types.Object:
    """Unwrap ``obj`` by projecting each face along its dominant axis; one repeat of a texture covers ``metres``."""
    mesh = obj.data
    points, corners = np.empty(3 * len(mesh.vertices)), np.empty(len(mesh.loops), np.int32)
    normals, starts = np.empty(3 * len(mesh.polygons)), np.empty(len(mesh.polygons), np.int32)
    mesh.vertices.foreach_get("co", points)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("normal", normals)
    mesh.polygons.foreach_get("loop_start", starts)
    axis = np.abs(normals.reshape(-1, 3)).argmax(axis=1)
    face = np.searchsorted(starts, np.arange(len(corners)), side="right") - 1
    planes = np.array([(1, 2), (0, 2), (0, 1)])[axis[face]]
    uv = np.take_along_axis(points.reshape(-1, 3)[corners], planes, axis=1) / metres
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", uv.astype(np.float32).ravel())
    return obj


def lamp(name: str, kind: str, location, energy: float, color=(1.0, 1.0, 1.0), target=None, **settings) -> bpy.types.Object:
    """A lamp of Blender's ``kind`` (POINT, SPOT, AREA, SUN) looking at ``target``; ``settings`` are set on its data."""
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, color
    for key, value in settings.items():
        setattr(data, key, value)
    obj = link(bpy.data.objects.new(name, data))
    obj.location = location
    if target is not None:
        obj.rotation_euler = look(location, target)
    obj.visible_camera = False
    return obj


def look(location, target):
    """Euler angles that turn −Z from ``location`` towards ``target``, with Y as up as can be."""
    return (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()


def probe_volume(name: str, low, high, resolution) -> bpy.types.Object:
    """A Light Probe Volume over the box ``low`` to ``high`` with ``resolution`` (x, y, z) cell-centred samples."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    data = bpy.data.lightprobes.new(name, "VOLUME")
    data.resolution_x, data.resolution_y, data.resolution_z = resolution
    obj = link(bpy.data.objects.new(name, data))
    obj.location, obj.scale = (low + high) / 2, (high - low) / 2
    return obj


def sphere_probe(name: str, low, high) -> bpy.types.Object:
    """A Light Probe Sphere in the middle of the box from ``low`` to ``high``, which it stands for: its parallax is that box, and
    its influence a little more, so that the box's own walls are in it."""
    data = bpy.data.lightprobes.new(name, "SPHERE")
    data.influence_type = data.parallax_type = "BOX"
    data.influence_distance, data.falloff, data.use_custom_parallax, data.parallax_distance = 1.1, 0.05, True, 1.0
    data.clip_start, data.clip_end = 0.01, 100.0
    obj = link(bpy.data.objects.new(name, data))
    obj.location = [0.5 * (a + b) for a, b in zip(low, high, strict=True)]
    obj.scale = [0.5 * (b - a) for a, b in zip(low, high, strict=True)]
    return obj


def camera(location, target, lens: float = 28.0, resolution=(640, 360)) -> bpy.types.Object:
    """The scene's camera at ``location`` looking at ``target``, with a focal length ``lens`` [mm] on a 36 mm sensor."""
    scene = bpy.context.scene
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_start = lens, 0.01
    obj = link(bpy.data.objects.new("Camera", data))
    obj.location, obj.rotation_euler = location, look(location, target)
    scene.camera = obj
    scene.render.resolution_x, scene.render.resolution_y = resolution
    return obj


def instance(name: str, collection: bpy.types.Collection, matrix: Matrix) -> bpy.types.Object:
    """An empty that instances ``collection`` under ``matrix``."""
    obj = link(bpy.data.objects.new(name, None))
    obj.instance_type, obj.instance_collection = "COLLECTION", collection
    obj.matrix_world = matrix
    return obj
