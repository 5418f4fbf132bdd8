"""One evaluated bpy mesh as plain triangle arrays, read in bulk."""

import numpy as np

from ...scene import Mesh
from ..materials import ACTIVE_COLOR

# Components of an attribute's data type, and the property that holds them.
_ATTRIBUTE_TYPES = {
    "FLOAT": (1, "value", np.float32), "INT": (1, "value", np.int32), "INT8": (1, "value", np.int32),
    "BOOLEAN": (1, "value", bool), "FLOAT2": (2, "vector", np.float32), "FLOAT_VECTOR": (3, "vector", np.float32),
    "FLOAT_COLOR": (4, "color", np.float32), "BYTE_COLOR": (4, "color", np.float32),
}


class MeshReader:
    """Reads one evaluated mesh (``bpy.types.Mesh``). Its arrays are copies and outlive the mesh; the reader itself does not.

    ``triangle_slot`` (t,) int32 is each triangle's material slot, ``corner_loops`` (t, 3) int32 the loop of each corner.
    """

    def __init__(self, mesh):
        self._mesh = mesh
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        self.triangles = _bulk(mesh.loop_triangles, "vertices", count, 3, np.int32)
        self.corner_loops = _bulk(mesh.loop_triangles, "loops", count, 3, np.int32)
        self._polygons = None
        material_index = mesh.attributes.get("material_index")
        if material_index is None:
            self.triangle_slot = np.zeros(count, np.int32)
        else:
            polygon_slot = _bulk(material_index.data, "value", len(mesh.polygons), 1, np.int32)[:, 0]
            self.triangle_slot = polygon_slot[self._triangle_polygons()]

    def read(self, name: str, attributes) -> Mesh:
        """Everything but materials, as a ``Mesh`` called ``name``; ``triangle_material`` holds slots. ``attributes`` as below."""
        mesh = self._mesh
        positions = mesh.attributes.get("position")
        vertices = (_bulk(positions.data, "vector", len(mesh.vertices), 3) if positions is not None
                    else _bulk(mesh.vertices, "co", len(mesh.vertices), 3))
        uv_layers = {layer.name: _bulk(layer.uv, "vector", len(mesh.loops), 2)[self.corner_loops] for layer in mesh.uv_layers}
        active_uv = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
        return Mesh(name, vertices, self.triangles, self.triangle_slot, self._corner_normals(), uv_layers, active_uv,
                    self.attributes(attributes))

    def attributes(self, names) -> dict[str, np.ndarray]:
        """Those attributes of ``names`` that the mesh has, as (t, 3, 4) float32 RGBA corners: scalars grey, vectors as RGB,
        colours scene-linear, alpha 1 where there is none. ``ACTIVE_COLOR`` is the colour attribute active for render."""
        mesh, found = self._mesh, {}
        for name in names:
            source = name
            if name == ACTIVE_COLOR:
                index = mesh.color_attributes.render_color_index
                if not 0 <= index < len(mesh.color_attributes):
                    continue
                source = mesh.color_attributes[index].name
            attribute = mesh.attributes.get(source)
            corners = self._corner_index(attribute)
            if corners is None or attribute.data_type not in _ATTRIBUTE_TYPES:
                continue
            width, member, dtype = _ATTRIBUTE_TYPES[attribute.data_type]
            values = _bulk(attribute.data, member, len(attribute.data), width, dtype).astype(np.float32, copy=False)
            rgba = np.zeros((len(values), 4), np.float32)
            rgba[:, :3 if width == 1 else width] = values
            if width < 4:
                rgba[:, 3] = 1.0
            found[name] = rgba[corners]
        return found

    def _corner_index(self, attribute):
        """The element of ``attribute`` at each corner, broadcastable to (t, 3); None where it has no value on corners."""
        if attribute is None:
            return None
        if attribute.domain == "CORNER":
            return self.corner_loops
        if attribute.domain == "POINT":
            return self.triangles
        if attribute.domain == "FACE":
            return np.repeat(self._triangle_polygons()[:, None], 3, axis=1)
        return None

    def _corner_normals(self):
        mesh = self._mesh
        if mesh.normals_domain == "FACE" or not len(mesh.loops):
            return None
        return _bulk(mesh.corner_normals, "vector", len(mesh.loops), 3)[self.corner_loops]

    def _triangle_polygons(self):
        if self._polygons is None:
            self._polygons = _bulk(self._mesh.loop_triangles, "polygon_index", len(self.triangles), 1, np.int32)[:, 0]
        return self._polygons


def _bulk(collection, member, count, width, dtype=np.float32):
    """``count`` × ``width`` values of a bpy collection in one call."""
    values = np.empty(count * width, dtype)
    collection.foreach_get(member, values)
    return values.reshape(count, width)
