"""What a shader may ask about the ray that meets it and about where its surface stands.

A shader's answer can differ by the kind of ray (Light Path), by the side and the angle at which it is met, and from one object or
instance to the next. ``questions`` finds what a shader asks by following its links; ``Ray`` and ``placement.Placements`` have the
answers; `answered.py` writes them into a copy of its nodes for Cycles to evaluate, `nodes.py` reads them as constants.
"""

from dataclasses import dataclass, replace

from .links import displacement_of, volume_of

# Light Path as Cycles answers it: a diffuse ray that left a surface, a shadow ray on its way to a light, a sample of an emissive
# surface as a light source, and the camera's own.
# Outputs that are not named are 0.
_LIGHT_PATH = {
    "camera": {"Is Camera Ray": 1.0},
    "diffuse": {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0},
    "light": {"Ray Depth": 1.0, "Diffuse Depth": 1.0},
    "shadow": {"Is Shadow Ray": 1.0, "Ray Depth": 2.0, "Diffuse Depth": 1.0},
}
# How far [m] a ray is taken to have come: unlike its kind this differs from one to the next.
RAY_LENGTH = 1.0

# What a shader asks: the kind of a question and what it names. These have no name.
KIND, DEPTH, SIDE, ANGLE, WORLD, CAMERA = ("kind",), ("depth",), ("side",), ("angle",), ("world",), ("camera",)
# What each instance answers for itself (placement.Placements); everything else is the ray's or the same for all.
PLACEMENT = {"world", "object", "particle", "instancer", "attribute"}


@dataclass(frozen=True)
class Ray:
    """A ray that meets a surface: its ``kind`` ('diffuse', 'shadow', 'light' or 'camera'), the number of ``further`` reflections
    behind a first one, whether it meets the ``back``, and the ``cosine`` between the normal on that side and the way back along
    the ray (None: straight on), with the ``turn`` [radians] about the normal. ``length`` [m] is how far it has come (None: as
    far as it has)."""

    kind: str = "diffuse"
    further: int = 0
    back: bool = False
    cosine: float | None = None
    turn: float = 0.0
    length: float | None = RAY_LENGTH

    def light_path(self, output: str) -> float:
        """What the Light Path node gives at ``output`` (its identifier)."""
        if output == "Ray Length":
            return self.length
        further = self.further if output in ("Ray Depth", "Diffuse Depth") else 0
        return _LIGHT_PATH[self.kind].get(output, 0.0) + further

    def seen_by(self, asked: frozenset) -> "Ray":
        """The ray without what a shader that asks ``asked`` does not look at: rays that it cannot tell apart become equal."""
        fields = {} if KIND in asked else {"kind": "diffuse"}
        fields |= {} if DEPTH in asked else {"further": 0}
        fields |= {} if SIDE in asked else {"back": False}
        fields |= {} if ANGLE in asked else {"cosine": None, "turn": 0.0}
        return replace(self, **fields)


def questions(socket, path: tuple = ()) -> frozenset:
    """Everything that what feeds ``socket`` asks: an input of a node, or an output with the node's own inputs; ``path`` are the
    group nodes around it.

    Each question is a tuple: KIND, DEPTH, SIDE, ANGLE, WORLD (where the surface stands), CAMERA, ('object', output),
    ('particle', output), ('instancer', output), ('attribute', type, name), ('unknown', words for the user). Muted nodes are taken
    as if they were not, and the normals of closures and Fresnel terms are left out, for they are not followed.
    """
    found, seen, pending = set(), set(), [(socket, path)]
    while pending:
        socket, path = pending.pop()
        key = socket.as_pointer(), tuple(node.as_pointer() for node in path)
        if key in seen:
            continue
        seen.add(key)
        if not socket.is_output:
            pending += [(link.from_socket, path) for link in socket.links if link.is_valid and not link.is_muted]
            continue
        node = socket.node
        if node.bl_idname == "ShaderNodeGroup":
            for inner in node.node_tree.nodes if node.node_tree is not None else ():
                if inner.bl_idname == "NodeGroupOutput" and inner.is_active_output:
                    pending += [(into, (*path, node)) for into in inner.inputs if into.identifier == socket.identifier]
        elif node.bl_idname == "NodeGroupInput":
            if path:
                pending += [(into, path[:-1]) for into in path[-1].inputs if into.identifier == socket.identifier]
        else:
            found.update(_ASKS.get(node.bl_idname, _nothing)(node, socket.identifier))
            pending += [(into, path) for into in node.inputs if not _is_bent_normal(node, into)]
    return frozenset(found)


def asks_of_material(material) -> frozenset:
    """``questions`` of the surface that the active Cycles output of a material shows, and of what moves it and of what fills it
    those that instances answer."""
    output = None if material.node_tree is None else material.node_tree.get_output_node("CYCLES")
    if output is None:
        return frozenset()
    where = frozenset().union(*(questions(*other) for other in (displacement_of(material), volume_of(material)) if other))
    return questions(output.inputs["Surface"]) | {question for question in where if question[0] in PLACEMENT}


def asked_of(node, output: str) -> tuple:
    """What one node asks for its ``output`` (identifier), whatever feeds it."""
    return _ASKS.get(node.bl_idname, _nothing)(node, output)


def _is_bent_normal(node, socket) -> bool:
    """Whether an input bends the normal of a closure or of a Fresnel term."""
    if socket.type != "VECTOR" or not ("Normal" in socket.name or socket.name == "Tangent"):
        return False
    return node.bl_idname in ("ShaderNodeLayerWeight", "ShaderNodeFresnel") or any(out.type == "SHADER" for out in node.outputs)


def _nothing(_node, _output) -> tuple:
    return ()


def _light_path(_node, output) -> tuple:
    if output == "Ray Length":
        return (("unknown", f"the length of each ray (taken as {RAY_LENGTH:g} m)"),)
    return (KIND, DEPTH) if output in ("Ray Depth", "Diffuse Depth") else (KIND,)


def _geometry(_node, output) -> tuple:
    return {"Backfacing": (SIDE,), "Position": (WORLD,), "Normal": (WORLD, SIDE), "True Normal": (WORLD, SIDE),
            "Tangent": (WORLD,), "Incoming": (WORLD, SIDE, ANGLE)}.get(output, ())


def _texture_coordinate(node, output) -> tuple:
    if output in ("Generated", "UV"):
        return (("instancer", output),) if node.from_instancer else ()
    if output == "Object":
        return () if node.object is None else (WORLD,)
    return {"Normal": (SIDE,), "Camera": (WORLD, CAMERA), "Window": (WORLD, CAMERA),
            "Reflection": (WORLD, SIDE, ANGLE)}.get(output, ())


def _attribute(node, _output) -> tuple:
    return () if node.attribute_type == "GEOMETRY" else (("attribute", node.attribute_type, node.attribute_name),)


def _fresnel(node, output) -> tuple:
    # Facing is the same from both sides; Fresnel turns the index of refraction round.
    return (ANGLE,) if output == "Facing" else (ANGLE, SIDE)


def _glass(node, _output) -> tuple:
    # What leaves glass is reflected totally beyond an angle, what enters it is not.
    if node.bl_idname != "ShaderNodeBsdfPrincipled":
        return (SIDE,)
    weight = node.inputs.get("Transmission Weight")
    return () if weight is None or (not weight.is_linked and weight.default_value == 0.0) else (SIDE,)


def _occlusion(node, _output) -> tuple:
    return () if node.only_local else (("unknown", "the Ambient Occlusion of other objects (taken as none)"),)


_ASKS = {
    "ShaderNodeLightPath": _light_path,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeTexCoord": _texture_coordinate,
    "ShaderNodeUVMap": lambda node, output: (("instancer", "UV"),) if node.from_instancer else (),
    "ShaderNodeObjectInfo": lambda node, output: () if output == "Material Index" else (("object", output),),
    "ShaderNodeParticleInfo": lambda node, output: (("particle", output),),
    "ShaderNodeAttribute": _attribute,
    "ShaderNodeLayerWeight": _fresnel,
    "ShaderNodeFresnel": _fresnel,
    "ShaderNodeCameraData": lambda node, output: (WORLD, CAMERA),
    "ShaderNodeVectorTransform": lambda node, output: (WORLD, CAMERA),
    "ShaderNodeNormalMap": lambda node, output: (WORLD, SIDE),
    "ShaderNodeBump": lambda node, output: (WORLD, SIDE),
    "ShaderNodeBevel": lambda node, output: (WORLD, SIDE),
    "ShaderNodeBsdfPrincipled": _glass,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeBsdfRefraction": _glass,
    "ShaderNodeTangent": lambda node, output: (WORLD,),
    "ShaderNodeAmbientOcclusion": _occlusion,
    "ShaderNodeRaycast": lambda node, output: (WORLD, ("unknown", "what is around it by a Raycast node (taken as nothing)")),
}
