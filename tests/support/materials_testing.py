"""Materials under test: build one on a grid, read it, and ask Cycles' own bake for the same numbers."""

import addon_utils
import bpy
import numpy as np

from rtgi_addon.blender.extract import extract_scene
from rtgi_addon.blender.materials import ACTIVE_COLOR, MaterialReader
from rtgi_addon.scene import Mesh

DATA = ("actions", "collections", "images", "lights", "materials", "meshes", "node_groups", "objects", "scenes", "shape_keys",
        "textures", "worlds")


def new_material(name="material"):
    """A material with an empty node tree, and its output node."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material, material.node_tree.nodes.new("ShaderNodeOutputMaterial")


def new_principled(name="material", **inputs):
    """(material, Principled node) with inputs set by name (underscores for spaces)."""
    material, output = new_material(name)
    node = material.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    return material, node


def glowing_material(build):
    """A diffuse surface that also emits what it reflects: ``build(tree)`` returns the colour socket of both."""
    material, output = new_material()
    tree = material.node_tree
    color = build(tree)
    diffuse, emission, both = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("BsdfDiffuse", "Emission", "AddShader"))
    for shader, index in ((diffuse, 0), (emission, 1)):
        tree.links.new(color, shader.inputs["Color"])
        tree.links.new(shader.outputs[0], both.inputs[index])
    tree.links.new(both.outputs[0], output.inputs["Surface"])
    return material


def grid_object(material, cells=6, name="grid"):
    """A grid over [−1, 1]² with the UV maps 'UVMap' (active) and 'Other' (stretched and shifted), linked to the scene."""
    side = np.linspace(-1.0, 1.0, cells + 1)
    x, y = np.meshgrid(side, side)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    low = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    faces = np.stack([low, low + 1, low + cells + 2, low + cells + 1], axis=1)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    for layer, scale, shift in (("UVMap", 0.4713, 0.5129), ("Other", 0.8111, 0.3517)):
        uv = vertices[faces.ravel(), :2] * scale + shift
        mesh.uv_layers.new(name=layer).uv.foreach_set("vector", uv.ravel().astype(np.float32))
    mesh.uv_layers.active = mesh.uv_layers["UVMap"]
    mesh.uv_layers["UVMap"].active_render = True
    if material is not None:
        mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    return thing


def cycles_bake(thing, kind):
    """(loops, 3) what Cycles' vertex bake of an object's own mesh gives: 'EMIT', or 'DIFFUSE' for its colour."""
    enable_cycles()
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    mesh = thing.data
    active = mesh.color_attributes.active_color_index
    layer = mesh.color_attributes.new("expected", "FLOAT_COLOR", "CORNER")
    mesh.color_attributes.active_color = layer
    view_layer.update()
    for other in view_layer.objects:
        other.select_set(other == thing)
    view_layer.objects.active = thing
    bpy.ops.object.bake(type=kind, pass_filter={"COLOR"}, target="VERTEX_COLORS")
    layer = mesh.color_attributes["expected"]
    result = np.empty(len(layer.data) * 4, np.float32)
    layer.data.foreach_get("color", result)
    mesh.color_attributes.remove(layer)
    if active >= 0:
        mesh.color_attributes.active_color_index = active
    return result.reshape(-1, 4)[:, :3]


def enable_cycles():
    """Register Cycles, as a Blender with a window does by itself."""
    if not hasattr(bpy.types.Scene, "cycles"):
        addon_utils.enable("cycles")


def read_object(thing):
    """(materials, mesh, reader, loops): an object's materials by slot, read or baked, and its mesh as arrays."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    evaluated = thing.evaluated_get(depsgraph)
    with MaterialReader(bpy.context.scene, depsgraph) as reader:
        sources = [slot.material for slot in evaluated.material_slots] or [None]
        materials = [reader.read(material) for material in sources]
        mesh, loops = arrays_of(evaluated.data)
        if any(material is None for material in materials):
            request = reader.request_bake(evaluated, sources, evaluated.matrix_world)
            mesh, baked = reader.bake(request, mesh, loops)
            materials = [baked.get(slot, material) for slot, material in enumerate(materials)]
    return materials, mesh, reader, loops


def said_of(reader):
    """What a reader says it does not follow, as one text."""
    return "\n".join(map(str, reader.omissions.all()))


def read_scene(with_mesh=False):
    """[(object name, materials by slot, 4×4 matrix)] of everything that extraction finds, in its order, and each one's mesh."""
    scene = extract_scene()
    found = []
    for instance in scene.instances:
        mesh = scene.meshes[instance.mesh]
        override = instance.material_override or {}
        used = [override.get(int(index), int(index)) for index in np.unique(mesh.triangle_material)]
        entry = instance.name, [scene.materials[index] for index in used], np.array(instance.world_from_local)
        found.append((*entry, mesh) if with_mesh else entry)
    return found


def arrays_of(data):
    """(mesh, (t, 3) loop indices): a bpy mesh as arrays, with its UV maps and colour attributes at corners."""
    data.calc_loop_triangles()
    loops, slots = np.empty(len(data.loop_triangles) * 3, np.int32), np.empty(len(data.loop_triangles), np.int32)
    data.loop_triangles.foreach_get("loops", loops)
    data.loop_triangles.foreach_get("material_index", slots)
    vertex, points = np.empty(len(data.loops), np.int32), np.empty(len(data.vertices) * 3, np.float32)
    data.loops.foreach_get("vertex_index", vertex)
    data.vertices.foreach_get("co", points)
    loops = loops.reshape(-1, 3)
    layers = {}
    for layer in data.uv_layers:
        uv = np.empty(len(data.loops) * 2, np.float32)
        layer.uv.foreach_get("vector", uv)
        layers[layer.name] = uv.reshape(-1, 2)[loops]
    attributes = {}
    for attribute in data.color_attributes:
        color = np.empty(len(attribute.data) * 4, np.float32)
        attribute.data.foreach_get("color", color)
        attributes[attribute.name] = color.reshape(-1, 4)[loops if attribute.domain == "CORNER" else vertex[loops]]
        if attribute == data.color_attributes[data.color_attributes.render_color_index]:
            attributes[ACTIVE_COLOR] = attributes[attribute.name]
    active = next((layer.name for layer in data.uv_layers if layer.active_render), None)
    return Mesh(data.name, points.reshape(-1, 3), vertex[loops], slots, None, layers, active, attributes), loops


def at_corners(channel, mesh):
    """(t, 3, 3) a channel's value at every corner of a mesh."""
    shape = (*mesh.triangles.shape, 3)
    result = np.broadcast_to(channel.constant, shape).astype(np.float64)
    if channel.texture is not None:
        uv = placed(channel, mesh.uv_layers[channel.uv_layer or mesh.active_uv])
        result = result * sampled(channel.texture, channel.texture_channel, uv)
    if channel.attribute is not None:
        result = result * mesh.attributes.get(channel.attribute, np.zeros((*shape[:2], 4)))[..., :3]
    return result if channel.offset is None else result + channel.offset


def placed(channel, uv):
    """UV (..., 2) after a channel's affine map."""
    return uv if channel.uv_transform is None else uv @ channel.uv_transform[:, :2].T + channel.uv_transform[:, 2]


def sampled(texture, component, uv):
    """(..., 3) a texture at UV (..., 2): filtered, then decoded, as Cycles does."""
    pixels = texture.pixels / 255.0 if texture.pixels.dtype == np.uint8 else texture.pixels.astype(np.float64)
    height, width = pixels.shape[:2]
    x, y = uv[..., 0] * width, uv[..., 1] * height
    if texture.interpolation == "Closest":
        taps = [(np.floor(x), np.floor(y), np.ones_like(x))]
    else:
        x, y = x - 0.5, y - 0.5
        fx, fy = x - np.floor(x), y - np.floor(y)
        taps = [(np.floor(x) + i, np.floor(y) + j, (fx if i else 1 - fx) * (fy if j else 1 - fy)) for i in (0, 1) for j in (0, 1)]
    result = 0.0
    for column, row, weight in taps:
        inside = np.ones(column.shape, bool)
        if texture.extension == "CLIP":
            inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        texel = pixels[_wrapped(row, height, texture.extension), _wrapped(column, width, texture.extension)]
        result = result + texel * (weight * inside)[..., None]
    if texture.srgb:
        decoded = np.where(result <= 0.04045, result / 12.92, ((result + 0.055) / 1.055) ** 2.4)
        result = np.concatenate([decoded[..., :3], result[..., 3:]], axis=-1)
    if component != "rgb":
        result = result[..., ["rgba".index(component)] * 3]
    return np.broadcast_to(result[..., :3], (*uv.shape[:-1], 3))


def _wrapped(index, count, extension):
    index = index.astype(np.int64)
    if extension == "REPEAT":
        return index % count
    if extension == "MIRROR":
        folded = index % (2 * count)
        return np.where(folded < count, folded, 2 * count - 1 - folded)
    return np.clip(index, 0, count - 1)


def random_image(name="picture", width=8, height=6, seed=1, alpha=False, float_buffer=False, low=0.1, high=0.9):
    """A packed image of random texels; its alpha is random too if asked for."""
    image = bpy.data.images.new(name, width, height, alpha=alpha, float_buffer=float_buffer)
    pixels = np.random.default_rng(seed).uniform(low, high, (height, width, 4)).astype(np.float32)
    if not alpha:
        pixels[..., 3] = 1.0
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def names_in_file():
    """Every datablock's name by kind: what a fallback must leave as it was."""
    return {kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in DATA}


def only(material):
    """The one material of a grid, read from its nodes."""
    (read,), *_ = read_object(grid_object(material))
    assert read.extraction == "nodes"
    return read


def closures(*nodes):
    """A material whose tree has these (kind, {input: value}) nodes; returns it with them and its output."""
    material, output = new_material()
    made = []
    for kind, inputs in nodes:
        node = material.node_tree.nodes.new(kind)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        made.append(node)
    return material, made, output
