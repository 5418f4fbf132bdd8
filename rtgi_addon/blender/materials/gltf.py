"""What of a material glTF can hold, by what Blender's exporter reads of it: a Principled BSDF whose inputs are values, images or
vertex colours. A plain Diffuse BSDF is put in those words; of all others it is said what the model shows in their place.

Source: the manual of Blender's glTF add-on, "Exported Materials"; `io_scene_gltf2/blender/exp/material`.
"""

import bpy

from .links import follow, nodes_of

# Inputs of a Principled BSDF that the exporter follows; nodes that it understands on the way to an image or a vertex colour.
_FOLLOWED = ("Base Color", "Metallic", "Roughness", "Normal", "Emission Color", "Emission Strength", "Alpha")
_UNDERSTOOD = {"TEX_IMAGE", "NORMAL_MAP", "SEPARATE_COLOR", "SEPRGB", "VERTEX_COLOR", "ATTRIBUTE", "MIX", "MIX_RGB", "MATH",
               "MAPPING", "UVMAP", "RGB", "VALUE", "COMBINE_COLOR", "TEX_COORD"}
_NAMES = {"BSDF_GLASS": "glass", "BSDF_TRANSPARENT": "transparency", "BSDF_TRANSLUCENT": "translucency", "BSDF_GLOSSY": "gloss",
          "MIX_SHADER": "a mix of shaders", "ADD_SHADER": "a sum of shaders", "BSDF_REFRACTION": "refraction"}


def replacement(material) -> tuple[bpy.types.Material, str]:
    """The bpy ``material`` as Blender's glTF exporter can read it, itself or one made for it, which the caller removes; and what
    the exporter loses of it, "" for nothing."""
    tree = nodes_of(material)
    output = None if tree is None else tree.get_output_node("CYCLES")
    if output is None:
        return material, ""
    (shader, _), _ = follow(output.inputs["Surface"], ())
    node = shader.node if shader.is_output else None
    if node is None or node.type in {"BSDF_PRINCIPLED", "EMISSION", "BACKGROUND"}:
        lost = [] if node is None or node.type != "BSDF_PRINCIPLED" else _lost_inputs(node)
        if not lost:
            return material, ""
        return material, (f"material {material.name}: glTF does not hold the nodes behind {', '.join(lost)}, the model shows the "
                          "value of the input")
    if node.type == "BSDF_DIFFUSE":
        made = _principled(material, node)
        if made is not None:
            return made, ""
    kind = _NAMES.get(node.type, node.bl_label)
    return material, f"material {material.name}: glTF does not hold {kind}, the model shows white in its place"


def _lost_inputs(node) -> list[str]:
    lost = []
    for name in _FOLLOWED:
        socket = node.inputs.get(name)
        if socket is not None and socket.is_linked and not _readable(socket, 0):
            lost.append(name)
    return lost


def _readable(socket, depth: int) -> bool:
    """Whether all that feeds ``socket`` is understood."""
    (source, _), _ = follow(socket, ())
    if not source.is_output:
        return True
    node = source.node
    if node.type not in _UNDERSTOOD or depth > 8:
        return False
    return node.type == "TEX_IMAGE" or all(_readable(one, depth + 1) for one in node.inputs if one.is_linked)


def _principled(material, node):
    """A Principled material of the colour of the Diffuse ``node`` of ``material``; None where that is more than a value or an
    image."""
    (source, _), _ = follow(node.inputs["Color"], ())
    image = source.node if source.is_output and source.node.type == "TEX_IMAGE" else None
    if source.is_output and image is None:
        return None
    made = bpy.data.materials.new(material.name)
    if bpy.app.version < (5, 0):
        made.use_nodes = True
    made.node_tree.nodes.clear()
    shader, output = (made.node_tree.nodes.new(name) for name in ("ShaderNodeBsdfPrincipled", "ShaderNodeOutputMaterial"))
    made.node_tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    made.use_backface_culling = material.use_backface_culling
    shader.inputs["Roughness"].default_value = 1.0
    for name in ("Specular IOR Level", "Metallic"):
        shader.inputs[name].default_value = 0.0
    if image is None:
        shader.inputs["Base Color"].default_value = tuple(source.default_value)
        return made
    texture = made.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.extension, texture.interpolation = image.image, image.extension, image.interpolation
    made.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    return made
