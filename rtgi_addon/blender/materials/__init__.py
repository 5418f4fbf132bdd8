"""Blender materials as ``rtgi_addon.scene.Material``: by reading nodes, or by Cycles' own bake where nodes do not suffice. A node
that can be read exactly comes in with its formula in `nodes` or `shaders`; what cannot stays with the bake, which knows them
all.

How extraction uses it::

    with MaterialReader(scene, depsgraph) as reader:
        for instance in depsgraph.object_instances:             # evaluated data is alive
            materials = [slot.material for slot in instance.object.material_slots] or [None]
            read = [reader.read(material) for material in materials]
            if any(entry is None for entry in read):             # those slots need Cycles
                request = reader.request_bake(instance.object, materials, instance.matrix_world)
        for ...:                                                 # evaluated data is no longer used
            mesh, baked = reader.bake(request, mesh, corner_loops)   # baked: {slot: Material}, these replace the None entries
    scene_notes += reader.notes

``bake`` runs Blender operators that add and remove datablocks, which invalidates evaluated objects: hence two phases. Leaving the
``with`` block removes whatever a request still holds.

Meshes must carry what channels name: ``Mesh.attributes`` every name in ``reader.attributes`` that the mesh has (any domain and
type, spread to corners as RGBA: scalars grey, vectors as RGB, alpha 1; byte colours decoded to scene-linear), with
``ACTIVE_COLOR`` standing for the colour attribute active for render. A channel that names an attribute or UV map which a mesh
lacks reads 0 there, as in Cycles.
"""

from .reader import ACTIVE_COLOR, BakeRequest, MaterialReader

__all__ = ["ACTIVE_COLOR", "BakeRequest", "MaterialReader"]
