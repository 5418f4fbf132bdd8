"""The scene's world as radiance from every direction."""

import numpy as np

from ...scene import Mist, World
from ..fingerprint import node_digest
from ..materials.links import nodes_of
from ..remembered import answer
from .panorama import render_panorama
from .sockets import source_of

# Image pixels in these colour spaces are scene-linear as Blender hands them out.
_LINEAR_SPACES = {"Linear Rec.709", "Non-Color", "Linear", "Raw"}


def read_world(world, notes: list[str]) -> World:
    """A bpy world (or None: black). Runs Blender operators where nodes do not tell.

    A plain Background colour is a constant; a Background with an equirectangular Environment Texture, straight or through
    a Mapping that only rotates Generated coordinates, is the image's own pixels under a rotation; everything else (sky textures,
    mirror balls, gradients, mixes, groups) is a Cycles panorama of 1,024 × 512 texels.
    """
    # Cycles' settings are there only while its add-on is on.
    if world is None or not getattr(getattr(world, "cycles_visibility", None), "diffuse", True):
        return World.constant(0.0)
    tree = nodes_of(world)
    if tree is None:
        return World.constant(np.array(world.color))
    output = tree.get_output_node("CYCLES")
    surface = source_of(output.inputs["Surface"]) if output is not None else None
    if surface is None:
        return World.constant(0.0)
    background = surface.node
    if background.type == "BACKGROUND" and not background.mute and not background.inputs["Strength"].is_linked:
        strength = max(float(background.inputs["Strength"].default_value), 0.0)
        color = source_of(background.inputs["Color"])
        if color is None:
            return World.constant(np.maximum(background.inputs["Color"].default_value[:3], 0.0) * strength)
        if strength == 0.0:
            return World.constant(0.0)
        if color.node.type == "TEX_ENVIRONMENT":
            found = _environment(color.node, strength, notes)
            if found is not None:
                return found
    panorama = answer(lambda: node_digest(world), lambda: render_panorama(world))
    return World(np.maximum(panorama, 0.0), description="Cycles panorama")


def read_mist(world) -> Mist:
    """A bpy world's mist settings, which need no light of its own; Blender's defaults without a world."""
    if world is None:
        return Mist()
    settings = world.mist_settings
    return Mist(settings.start, settings.depth, settings.falloff.lower())


def _environment(node, strength, notes):
    """An Environment Texture read directly, or None where it takes a panorama."""
    image = node.image
    if image is None:
        return World.constant(np.array([1.0, 0.0, 1.0]) * strength)
    if image.size[0] == 0:
        notes.append(f"world: image {image.name!r} ({image.filepath}) is missing; Blender shows it pink, and so is the world")
        return World.constant(np.array([1.0, 0.0, 1.0]) * strength)
    if (node.mute or node.projection != "EQUIRECTANGULAR" or image.source not in {"FILE", "GENERATED"} or not image.is_float
            or image.colorspace_settings.name not in _LINEAR_SPACES):
        return None
    rotation = _rotation(node.inputs["Vector"])
    if rotation is None:
        return None
    width, height, channels = *image.size, image.channels
    pixels = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, channels)
    if channels == 4 and np.any(pixels[..., 3] < 1.0):  # versions differ in what transparency does here
        return None
    rgb = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    return World(np.maximum(np.nan_to_num(rgb * np.float32(strength), posinf=0.0), 0.0), rotation, f"image {image.name}")


def _rotation(socket):
    """map_from_world (3, 3) of an Environment Texture's Vector input: None unless it is a rotation of the world's directions."""
    source = source_of(socket)
    if source is None:
        return np.eye(3)
    if _is_direction(source):
        return np.eye(3)
    node = source.node
    if node.type != "MAPPING" or node.mute or any(node.inputs[name].is_linked for name in ("Location", "Rotation", "Scale")
                                                  if name in node.inputs):
        return None
    vector = source_of(node.inputs["Vector"])
    if vector is None or not _is_direction(vector):
        return None
    scale = np.array(node.inputs["Scale"].default_value)
    location = np.array(node.inputs["Location"].default_value) if "Location" in node.inputs else np.zeros(3)
    if not np.allclose(scale, scale[0]) or scale[0] <= 0.0:
        return None
    if node.vector_type in {"POINT", "TEXTURE"} and np.any(location != 0):
        return None
    rotation = np.array(node.inputs["Rotation"].default_value.to_matrix(), np.float64)
    return rotation.T if node.vector_type == "TEXTURE" else rotation


def _is_direction(source) -> bool:
    """True for the socket that gives a world shader the direction of view."""
    return source.node.type == "TEX_COORD" and source.name in {"Generated", "Object"} and source.node.object is None
