"""Following links backwards in a shader tree."""


def source_of(socket):
    """The output socket that feeds an input through reroutes, or None."""
    while socket.is_linked:
        link = socket.links[0]
        if link.is_muted:
            return None
        if link.from_node.type != "REROUTE":
            return link.from_socket
        socket = link.from_node.inputs[0]
    return None
