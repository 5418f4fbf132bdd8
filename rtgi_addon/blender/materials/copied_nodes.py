"""Nodes of one shader tree made anew in another: what Blender bakes of materials alone can be asked of a world's nodes, too."""

import bpy

from .values import Unreadable

# Where a node stands and what it looks like, and what Blender keeps of it itself.
_LEFT = frozenset({"location", "location_absolute", "width", "height", "parent", "select", "show_preview", "show_options",
                   "show_texture", "hide", "name", "label", "color", "use_custom_color", "color_tag", "warning_propagation"})


def copy_upstream(output, tree):
    """Make all nodes that feed ``output``, a socket of another tree, anew in ``tree``, which is empty of them; returns the output
    of the copy. Groups are shared, not copied. Raises Unreadable for nodes that come out otherwise, such as zones, which belong
    together by pairs."""
    made = {}

    def copied(node):
        if node.name not in made:
            new = made[node.name] = tree.nodes.new(node.bl_idname)
            new.label = node.label
            _copy_properties(node, new)
            if [socket.identifier for socket in new.inputs] != [socket.identifier for socket in node.inputs] \
                    or len(new.outputs) != len(node.outputs):
                raise Unreadable(node.label or node.name, "its sockets cannot be made anew")
            for source, target in zip(node.inputs, new.inputs, strict=True):
                if hasattr(source, "default_value") and not source.is_linked:
                    target.default_value = source.default_value
            for link in (link for socket in node.inputs for link in socket.links if not link.is_muted):
                start = copied(link.from_node).outputs[_index(link.from_node.outputs, link.from_socket)]
                tree.links.new(start, new.inputs[_index(node.inputs, link.to_socket)])
            new.mute = node.mute
        return made[node.name]

    return copied(output.node).outputs[_index(output.node.outputs, output)]


def material_of(world):
    """A bpy material, for the caller to remove, whose volume is that of a ``world``, which has one. Raises Unreadable."""
    output = world.node_tree.get_output_node("CYCLES").inputs["Volume"].links[0].from_socket
    material = bpy.data.materials.new(f"rtgi {world.name}")
    try:
        if material.node_tree is None:
            material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        copy = copy_upstream(output, tree)
        tree.links.new(copy, tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    except Exception:
        bpy.data.materials.remove(material)
        raise
    return material


def _index(sockets, socket) -> int:
    return next(number for number, other in enumerate(sockets) if other.identifier == socket.identifier)


def _copy_properties(source, target) -> None:
    """Everything that a user may set of ``source``, in the order in which Blender lists it: modes come before what they decide."""
    left = _LEFT if isinstance(source, bpy.types.Node) else ()
    for item in source.bl_rna.properties:
        name = item.identifier
        if name in left or name.startswith("bl_") or name in {"rna_type", "inputs", "outputs", "internal_links", "mute"}:
            continue
        if item.type == "POINTER" and item.is_readonly:
            inner = getattr(source, name)
            if inner is not None and not isinstance(inner, bpy.types.ID):
                _copy_properties(inner, getattr(target, name))
                if isinstance(inner, bpy.types.CurveMapping):
                    getattr(target, name).update()
        elif item.type == "COLLECTION":
            _copy_collection(getattr(source, name), getattr(target, name), source)
        elif not item.is_readonly:
            try:
                setattr(target, name, getattr(source, name))
            except (AttributeError, TypeError) as error:
                raise Unreadable(source.bl_rna.name, f"its {item.name} cannot be set ({error})") from error


def _copy_collection(source, target, owner) -> None:
    """Stops of a ramp and points of curves, each with all it has."""
    if isinstance(owner, bpy.types.ColorRamp):
        while len(target) > len(source):
            target.remove(target[-1])
        while len(target) < len(source):
            target.new(1.0)
    elif isinstance(owner, bpy.types.CurveMap):
        while len(target) > len(source):
            target.remove(target[-2])
        while len(target) < len(source):
            target.new(0.5, 0.5)
    for one, other in zip(source, target, strict=False):
        _copy_properties(one, other)
