"""Following links backwards through reroutes, muted nodes and groups."""

import bpy


def follow(socket, path: tuple):
    """((socket, path), types): the output that feeds an input, or the unlinked input whose default counts, seen through
    reroutes, muted nodes and groups. ``types`` are the socket types passed on the way, from the source to the input."""
    types = [socket.type]
    while True:
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None:
            return (socket, path), types[::-1]
        out, node = link.from_socket, link.from_node
        types.append(out.type)
        if node.mute:
            inside = next((inner.from_socket for inner in node.internal_links if inner.to_socket == out), None)
            # From 5.0 a muted node that nothing enters counts as no link: the input keeps its own value.
            if inside is None or not (inside.is_linked or bpy.app.version < (5, 0)):
                return (socket, path), types[-2::-1]
            socket = inside
        elif node.bl_idname == "NodeReroute":
            socket = node.inputs[0]
        elif node.bl_idname == "ShaderNodeGroup":
            end = _group_output(node.node_tree)
            socket = _Nothing(out.type) if end is None else by_identifier(end.inputs, out.identifier)
            path = (*path, node)
        elif node.bl_idname == "NodeGroupInput" and path:
            socket, path = by_identifier(path[-1].inputs, out.identifier), path[:-1]
        else:
            return (out, path), types[::-1]
        types.append(socket.type)


def nodes_of(owner):
    """The node tree that a bpy material, world or lamp is shaded by; None where it has none or does without."""
    # From these versions on they are always used, and asking for the flag warns that it will go.
    always = (5, 1) if isinstance(owner, bpy.types.Light) else (5, 0)
    return owner.node_tree if bpy.app.version >= always or owner.use_nodes else None


def displacement_of(material):
    """The (output, groups around it) that moves the surface of a bpy material (or None): what feeds the Displacement of its active
    output. None where nothing does, or where it is bump only."""
    return None if material is None or material.displacement_method == "BUMP" else _shown(material, "Displacement")


def volume_of(owner):
    """The (output, groups around it) of the volume shader of a bpy material or world (or None): what absorbs, scatters or emits
    light between surfaces. None where there is none."""
    return None if owner is None else _shown(owner, "Volume")


def is_medium_alone(material) -> bool:
    """Whether a bpy material (or None) fills an object with a medium and gives it no surface, so that nothing of it is drawn."""
    return volume_of(material) is not None and _shown(material, "Surface") is None


def _shown(owner, name: str):
    """The (output, groups around it) that feeds the input ``name`` of the active Cycles output; None where nothing does."""
    tree = nodes_of(owner)
    output = None if tree is None else tree.get_output_node("CYCLES")
    if output is None:
        return None
    (out, path), _ = follow(output.inputs[name], ())
    return (out, path) if out.is_output else None


class _Nothing:
    """Stands for the input of a muted or empty node that lets nothing through."""

    is_output = False
    default_value = 0.0
    links = ()
    node = None

    def __init__(self, kind: str):
        self.type = kind


def _group_output(tree):
    """The active output node of a group's tree, or None."""
    nodes = () if tree is None else tree.nodes
    return next((node for node in nodes if node.bl_idname == "NodeGroupOutput" and node.is_active_output), None)


def by_identifier(sockets, identifier: str):
    """The one of ``sockets`` with this identifier."""
    return next(socket for socket in sockets if socket.identifier == identifier)
