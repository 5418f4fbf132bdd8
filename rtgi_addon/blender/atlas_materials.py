"""The light atlas in Blender's own materials: nodes that read its images, so that EEVEE shows what was baked.

A material keeps its output; a second one, for EEVEE alone, shows base colour · E/π on the objects in the atlas, and the material's
own surface on others that wear it and on backs. Cycles and bakes go on reading the first. Where an object's map lies on the sheet
is a property of the object, so that objects can share materials.
"""

from pathlib import Path
from typing import NamedTuple

import bpy

from ..effects.atlas.coefficients import COUNT
from ..exchange.atlas_files import read_index

GROUP = "RTGI Light Atlas"
# On nodes: that they show an atlas. On objects: the scale and the offset [texels] of their map on the sheet.
MARK, PLACE = "rtgi_shows_atlas", "rtgi_atlas_place"
# What irradiance takes of each coefficient: A_l times the constant of Y_lm (effects/atlas/coefficients.py), and of which axis.
_BANDS = ((0.8862269, None), (1.0233267, "Y"), (1.0233267, "Z"), (1.0233267, "X"))
_INVERSE_PI = 0.31830989
_GREY = (0.8, 0.8, 0.8, 1.0)


class SetUp(NamedTuple):
    """How many ``objects`` and ``materials`` show an atlas now, and ``notes`` on those that do not."""

    objects: int
    materials: int
    notes: tuple[str, ...]


def set_up(scene: bpy.types.Scene, folder: Path) -> SetUp:
    """Make the materials of the objects of ``scene`` show the light atlas of the bundle ``folder``. Raises BakeError for one that
    has none or is damaged."""
    index = read_index(folder)
    remove(scene)
    group, notes, maps, count = _group(index, folder), [], {}, 0
    for part in index["parts"]:
        obj = scene.objects.get(part["name"])
        if obj is None or obj.type != "MESH" or part["uv_map"] not in obj.data.uv_layers:
            notes.append(f"{part['name']} of the light atlas is not in the scene with its UV map {part['uv_map']}")
            continue
        worn = [slot.material for slot in obj.material_slots if slot.material is not None]
        if not worn:
            notes.append(f"{obj.name} has no material that could show the light atlas")
            continue
        obj[PLACE] = (part["scale"], *part["offset"])
        count += 1
        for material in dict.fromkeys(worn):
            first, uv_map = maps.setdefault(material, (obj.name, part["uv_map"]))
            if uv_map != part["uv_map"]:
                notes.append(f"{material.name} reads one UV map, {uv_map} as on {first}, and not {part['uv_map']} of {obj.name}")
    told = [(material, _show(material, group, uv_map)) for material, (_, uv_map) in maps.items()]
    return SetUp(count, sum(not text for _, text in told), (*notes, *(text for _, text in told if text)))


def remove(scene: bpy.types.Scene) -> int:
    """Take the nodes out of all materials again; of how many."""
    count = 0
    for material in bpy.data.materials:
        nodes = material.node_tree.nodes if material.node_tree is not None and material.library is None else ()
        ours = [node for node in nodes if node.get(MARK)]
        count += bool(ours)
        for node in ours:
            nodes.remove(node)
    for obj in scene.objects:
        if PLACE in obj:
            del obj[PLACE]
    group = bpy.data.node_groups.get(GROUP)
    if group is not None and not group.users:
        bpy.data.node_groups.remove(group)
    return count


def shows_atlas(scene: bpy.types.Scene) -> bool:
    """Whether materials of ``scene`` were made to."""
    return any(PLACE in obj for obj in scene.objects)


def _show(material: bpy.types.Material, group: bpy.types.NodeTree, uv_map: str) -> str:
    """Give ``material`` an output for EEVEE that reads ``group`` at the places of ``uv_map``; why it cannot, or nothing."""
    tree = material.node_tree
    if material.library is not None or tree is None:
        return f"{material.name} has no nodes of this file that could show the light atlas"
    if any(node.bl_idname == "ShaderNodeOutputMaterial" and node.target == "EEVEE" for node in tree.nodes):
        return f"{material.name} has an output for EEVEE of its own"
    own = tree.get_output_node("EEVEE")
    if own is None or not own.inputs["Surface"].is_linked:
        return f"{material.name} has no surface that could show the light atlas"
    surface = own.inputs["Surface"].links[0].from_socket
    shader = surface.node

    def node(kind: str, across: float, down: float, **values) -> bpy.types.Node:
        made = tree.nodes.new(kind)
        made[MARK] = True
        made.location = own.location.x + across, own.location.y - 250.0 - down
        for name, value in values.items():
            setattr(made, name, value)
        return made

    link = tree.links.new
    shown = node("ShaderNodeGroup", -400.0, 0.0, node_tree=group, label=GROUP)
    link(node("ShaderNodeUVMap", -600.0, 0.0, uv_map=uv_map).outputs["UV"], shown.inputs["UV"])
    place = node("ShaderNodeAttribute", -600.0, 150.0, attribute_type="OBJECT", attribute_name=PLACE)
    link(place.outputs["Vector"], shown.inputs["Place"])
    geometry, normal = node("ShaderNodeNewGeometry", -600.0, 350.0), shader.inputs.get("Normal")
    link(normal.links[0].from_socket if normal is not None and normal.is_linked else geometry.outputs["Normal"],
         shown.inputs["Normal"])
    base = shader.inputs.get("Base Color") or shader.inputs.get("Color")
    _same(tree, base, shown.inputs["Base Color"], _GREY)
    _same(tree, shader.inputs.get("Metallic"), shown.inputs["Metallic"], 0.0)
    _same(tree, shader.inputs.get("Emission Color"), shown.inputs["Emission Color"], (0.0, 0.0, 0.0, 1.0))
    _same(tree, shader.inputs.get("Emission Strength"), shown.inputs["Emission Strength"], 0.0)
    mix = node("ShaderNodeMixShader", -200.0, 0.0)
    link(shown.outputs["Inside"], mix.inputs[0])
    link(surface, mix.inputs[1])
    link(shown.outputs["Light"], mix.inputs[2])
    output = node("ShaderNodeOutputMaterial", 0.0, 0.0, target="EEVEE")
    link(mix.outputs[0], output.inputs["Surface"])
    for name in ("Volume", "Displacement"):
        if own.inputs[name].is_linked:
            link(own.inputs[name].links[0].from_socket, output.inputs[name])
    return "" if base is not None else f"{material.name} has no base colour that could be read, and shows grey"


def _same(tree: bpy.types.NodeTree, source, target, otherwise) -> None:
    """Give the socket ``target`` what ``source`` (None: ``otherwise``) has."""
    if source is not None and source.is_linked:
        tree.links.new(source.links[0].from_socket, target)
    else:
        target.default_value = otherwise if source is None else source.default_value


def _group(index: dict, folder: Path) -> bpy.types.NodeTree:
    """The node group that reads the images of the atlas with that ``index`` in ``folder``."""
    group = bpy.data.node_groups.get(GROUP) or bpy.data.node_groups.new(GROUP, "ShaderNodeTree")
    group.nodes.clear()
    group.interface.clear()
    for name, kind in (("UV", "Vector"), ("Place", "Vector"), ("Normal", "Vector"), ("Base Color", "Color"), ("Metallic", "Float"),
                       ("Emission Color", "Color"), ("Emission Strength", "Float")):
        group.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
    for name, kind in (("Light", "Shader"), ("Irradiance", "Color"), ("Inside", "Float")):
        group.interface.new_socket(name, in_out="OUTPUT", socket_type=f"NodeSocket{kind}")
    given, link = group.nodes.new("NodeGroupInput"), group.links.new

    def set_inputs(made: bpy.types.Node, values) -> None:
        for socket, value in zip([entry for entry in made.inputs if entry.enabled], values, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                link(value, socket)
            else:
                socket.default_value = value

    def math(operation: str, *values) -> bpy.types.NodeSocket:
        made = group.nodes.new("ShaderNodeMath")
        made.operation = operation
        set_inputs(made, values)
        return made.outputs[0]

    def vector(operation: str, *values) -> bpy.types.NodeSocket:
        made = group.nodes.new("ShaderNodeVectorMath")
        made.operation = operation
        set_inputs(made, values)
        return next(socket for socket in made.outputs if socket.enabled)

    def split(source) -> list[bpy.types.NodeSocket]:
        made = group.nodes.new("ShaderNodeSeparateXYZ")
        link(source, made.inputs[0])
        return list(made.outputs)

    u, v, _ = split(given.outputs["UV"])
    scale, x, y = split(given.outputs["Place"])
    # st = (u, 1 - v); texels = st * scale + offset, row 0 on top, and images have theirs at the bottom.
    across = math("DIVIDE", math("MULTIPLY_ADD", u, scale, x), float(index["width"]))
    down = math("DIVIDE", math("MULTIPLY_ADD", math("SUBTRACT", 1.0, v), scale, y), float(index["height"]))
    place = group.nodes.new("ShaderNodeCombineXYZ")
    set_inputs(place, (across, math("SUBTRACT", 1.0, down)))
    axes = dict(zip("XYZ", split(vector("NORMALIZE", given.outputs["Normal"])), strict=True))
    total = None
    for number, (band, axis) in zip(range(COUNT), _BANDS, strict=True):
        image = group.nodes.new("ShaderNodeTexImage")
        image.image, image.extension, image.interpolation = _image(folder / index["sh"][number]), "EXTEND", "Linear"
        link(place.outputs[0], image.inputs["Vector"])
        taken = vector("SCALE", image.outputs["Color"], band if axis is None else math("MULTIPLY", axes[axis], band))
        total = taken if total is None else vector("ADD", total, taken)
    irradiance = vector("MAXIMUM", total, (0.0, 0.0, 0.0))
    diffuse = vector("SCALE", vector("MULTIPLY", irradiance, given.outputs["Base Color"]),
                     math("MULTIPLY", math("SUBTRACT", 1.0, given.outputs["Metallic"]), _INVERSE_PI))
    own = vector("SCALE", given.outputs["Emission Color"], given.outputs["Emission Strength"])
    emission, result = group.nodes.new("ShaderNodeEmission"), group.nodes.new("NodeGroupOutput")
    link(vector("ADD", diffuse, own), emission.inputs["Color"])
    link(emission.outputs[0], result.inputs["Light"])
    link(irradiance, result.inputs["Irradiance"])
    facing = math("SUBTRACT", 1.0, group.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"])
    link(math("MULTIPLY", math("GREATER_THAN", scale, 0.0), facing), result.inputs["Inside"])
    return group


def _image(path: Path) -> bpy.types.Image:
    """The image at ``path`` as numbers, read anew: bakes write it again."""
    image = bpy.data.images.load(str(path), check_existing=True)
    image.colorspace_settings.name = "Non-Color"
    image.reload()
    return image
