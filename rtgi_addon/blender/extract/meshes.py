"""One evaluated bpy mesh as plain triangle arrays, read in bulk."""

import bpy
import numpy as np

from ...scene import Mesh
from ..materials.attributes import ACTIVE_COLOR, elements, number_of, source_and_part, weights


class MeshReader:
    """Reads one evaluated mesh (``bpy.types.Mesh``). Its arrays are copies and outlive the mesh; the reader itself does not.

    ``triangle_slot`` (t,) int32 is each triangle's material slot, ``corner_loops`` (t, 3) int32 the loop of each corner.
    ``vertex_groups`` are those of the mesh's object: shaders read them as attributes.
    """

    def __init__(self, mesh, vertex_groups=()):
        self._mesh, self._groups = mesh, {group.name: group for group in vertex_groups}
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
                    self.attributes(attributes), self._marked_edges())

    def _marked_edges(self):
        """Pairs of vertices (e, 2) of the edges marked for Freestyle, None where there are none."""
        edges = self._mesh.edges
        marks = self._mesh.attributes.get("freestyle_edge")
        if marks is not None:
            marked = _bulk(marks.data, "value", len(edges), 1, bool)[:, 0]
        elif "use_freestyle_mark" in bpy.types.MeshEdge.bl_rna.properties:
            marked = _bulk(edges, "use_freestyle_mark", len(edges), 1, bool)[:, 0]
        else:
            return None
        return _bulk(edges, "vertices", len(edges), 2, np.int32)[marked] if marked.any() else None

    def attributes(self, names) -> dict[str, np.ndarray]:
        """Those attributes of ``names`` (see `materials/attributes.py`) that the mesh has, as (t, 3, 4) float32 RGBA corners."""
        found = {name: self._attribute(name) for name in names}
        return {name: corners for name, corners in found.items() if corners is not None}

    def _attribute(self, name: str) -> np.ndarray | None:
        mesh = self._mesh
        source, part = source_and_part(name)
        if source == ACTIVE_COLOR:
            index = mesh.color_attributes.render_color_index
            source = mesh.color_attributes[index].name if 0 <= index < len(mesh.color_attributes) else ""
        attribute = mesh.attributes.get(source)
        if attribute is None and source in self._groups:
            return number_of(weights(mesh, self._groups[source]), part)[self.triangles]
        corners, values = self._corner_index(attribute), elements(attribute)
        return None if corners is None or values is None else number_of(values[0], part, values[1])[corners]

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
