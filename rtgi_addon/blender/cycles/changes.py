"""Blender's scene without a suspect: the twin of evaluate.verify.replaced. Everything is put back at the end."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from ...evaluate.verify.suspects import GREY, LAMP, MATERIAL, OBJECT, WORLD, Suspect, plain_world
from ...scene import Scene
from ...scene.lights import NOT_AT_ALL
from ...transport.lights.kinds import kind_of


@contextmanager
def changed(scene: bpy.types.Scene, extracted: Scene, without: tuple[Suspect, ...]) -> Iterator[None]:
    """``scene``, which was read as ``extracted``, with every suspect of ``without`` left out or replaced."""
    undo = []
    try:
        for suspect in without:
            _CHANGES[suspect.kind](scene, extracted, suspect.name, undo)
        yield
    finally:
        for back in reversed(undo):
            back()


def _set(owner, name, value, undo) -> None:
    before = getattr(owner, name)
    undo.append(lambda: setattr(owner, name, before))
    setattr(owner, name, value)


def _own(collection, block, undo):
    undo.append(lambda: collection.remove(block))
    return block


def _hide(_scene, _extracted, name, undo) -> None:
    for obj in bpy.data.objects:
        if obj.name == name:
            _set(obj, "hide_render", True, undo)


def _bare_lamp(scene, extracted, name, undo) -> None:
    light = next((light for light in extracted.lights if light.name == name), None)
    if light is None or light.bake == NOT_AT_ALL:  # it was not read, or no bake knows it: then it is left out
        _hide(scene, extracted, name, undo)
        return
    plain = kind_of(light).plain(light)
    strength = np.maximum(plain.strength, 0.0)
    peak = max(float(strength.max()), 1e-30)
    is_sun = kind_of(plain).is_distant
    data = _own(bpy.data.lights, bpy.data.lights.new("RTGI plain lamp", "SUN" if is_sun else "POINT"), undo)
    data.color = strength / peak
    data.energy = peak if is_sun else 4.0 * np.pi * peak
    if is_sun:
        data.angle = 0.0
    else:
        data.shadow_soft_size = 0.0
    for obj in bpy.data.objects:
        if obj.name == name and obj.type == "LIGHT":
            _set(obj, "data", data, undo)
            if getattr(obj, "light_linking", None) is not None:
                _set(obj.light_linking, "receiver_collection", None, undo)
                _set(obj.light_linking, "blocker_collection", None, undo)


def _grey(_scene, _extracted, name, undo) -> None:
    for material in bpy.data.materials:
        tree = material.node_tree
        if material.name != name or tree is None:
            continue
        output = tree.get_output_node("CYCLES")
        if output is None:
            continue
        into = output.inputs["Surface"]
        before = into.links[0].from_socket if into.is_linked else None
        diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = (GREY, GREY, GREY, 1.0)

        def back(tree=tree, diffuse=diffuse, into=into, before=before):
            tree.nodes.remove(diffuse)
            if before is not None:
                tree.links.new(before, into)

        undo.append(back)
        tree.links.new(diffuse.outputs["BSDF"], into)


def _even_world(scene, extracted, _name, undo) -> None:
    world = _own(bpy.data.worlds, bpy.data.worlds.new("RTGI even world"), undo)
    if world.node_tree is None:
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    radiance = plain_world(extracted.world).equirect[0, 0]
    peak = max(float(radiance.max()), 1e-30)
    background.inputs["Color"].default_value = (*(radiance / peak), 1.0)
    background.inputs["Strength"].default_value = peak
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    _set(scene, "world", world, undo)


_CHANGES = {OBJECT: _hide, LAMP: _bare_lamp, MATERIAL: _grey, WORLD: _even_world}
