"""Attributes of meshes as shaders read them: whole, or one number of them, under the names by which a ``Mesh`` carries them."""

import numpy as np

# The name under which a mesh carries whichever colour attribute is active for render.
ACTIVE_COLOR = "_rtgi_active_color"
# What precedes the name of an attribute of which an Attribute node gives one number.
_PARTS = {"Fac": "_rtgi_fac:", "Alpha": "_rtgi_alpha:"}
# Components of an attribute's data type, the property that holds them, and its type.
_TYPES = {
    "FLOAT": (1, "value", np.float32), "INT": (1, "value", np.int32), "INT8": (1, "value", np.int32),
    "BOOLEAN": (1, "value", bool), "FLOAT2": (2, "vector", np.float32), "FLOAT_VECTOR": (3, "vector", np.float32),
    "FLOAT_COLOR": (4, "color", np.float32), "BYTE_COLOR": (4, "color", np.float32),
}


def part_of(name: str, output: str) -> str:
    """The name under which a mesh carries what an Attribute node of ``name`` gives at ``output`` (its identifier)."""
    return _PARTS.get(output, "") + name


def source_and_part(name: str) -> tuple[str, str]:
    """The attribute, and the output of an Attribute node ('Color', 'Fac' or 'Alpha'), that a name by ``part_of`` stands for."""
    for output, prefix in _PARTS.items():
        if name.startswith(prefix):
            return name.removeprefix(prefix), output
    return name, "Color"


def number_of(rgba: np.ndarray, output: str, components: int = 4) -> np.ndarray:
    """RGBA (..., 4) with what an Attribute node gives at ``output`` in RGB: a vector of two ``components`` counts by its first
    as a number, others by their mean."""
    if output == "Color":
        return rgba
    value = rgba[..., 3] if output == "Alpha" else rgba[..., 0] if components == 2 else rgba[..., :3].mean(axis=-1)
    return np.concatenate([np.repeat(value[..., None], 3, axis=-1), np.ones((*value.shape, 1), np.float32)], axis=-1)


def elements(attribute) -> tuple[np.ndarray, int] | None:
    """((n, 4) float32 RGBA, components) of a bpy attribute, one row per element: scalars grey, vectors as RGB, colours
    scene-linear, alpha 1 where there is none. None for types that shaders do not read."""
    if getattr(attribute, "data_type", None) not in _TYPES:
        return None
    width, member, dtype = _TYPES[attribute.data_type]
    values = np.empty(len(attribute.data) * width, dtype)
    attribute.data.foreach_get(member, values)
    rgba = np.zeros((len(attribute.data), 4), np.float32)
    rgba[:, :3 if width == 1 else width] = values.reshape(-1, width)
    if width < 4:
        rgba[:, 3] = 1.0
    return rgba, width


def weights(mesh, group) -> np.ndarray:
    """(vertices, 4) float32 RGBA: the weight of every vertex of a bpy mesh in a vertex group, 0 outside it."""
    rgba = np.ones((len(mesh.vertices), 4), np.float32)
    rgba[:, :3] = np.array([next((entry.weight for entry in vertex.groups if entry.group == group.index), 0.0)
                            for vertex in mesh.vertices], np.float32)[:, None]
    return rgba
