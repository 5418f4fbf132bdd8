"""Where probes of the next bake stand, in the interface: on lattices or scattered, and the operator that shows those beforehand.

It shows them as Empties of a collection, which can be moved, deleted and added to, and be the probes of the bake.
"""

from dataclasses import fields, replace

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...errors import BakeError
from ...jobs.scatter import scattered_scene
from ...progress import Progress
from ...techniques.lattice.focus import spacing_of
from ...techniques.scattered.settings import SCATTER
from ..extract import extract_scene
from ..session import session
from ..worker import Job
from .modal_job import CancelJob, ModalJob, register_job, unregister_job
from .panel_kinds import Closed, InRender, split
from .panels import draw_setting
from .properties import scatter_settings, scene_settings
from .sidebar import draw_job

COLLECTION = "Scattered Probes"
# More Empties than this make Blender slow.
MOST = 5000
# The size of an Empty as a share of the least spacing.
_SIZE = 0.1

placing = Job()


class RTGI_OT_place_probes(ModalJob, bpy.types.Operator):
    """Show where scattered probes will stand, as Empties of the collection Scattered Probes, which can be moved and then baked"""

    bl_idname = "rtgi.place_probes"
    bl_label = "Show Scattered Probes"
    bl_options = {"REGISTER", "UNDO"}
    job = placing
    noun = "placement"

    @classmethod
    def poll(cls, context):
        """Not while something else traces rays."""
        return cls._free(rpt_("A bake or a placement is already running"))

    def _work(self, context):
        technique, settings = scene_settings(context.scene)
        chosen = replace(scatter_settings(context.scene), placement="scattered")
        if chosen.points == COLLECTION:
            # What was shown before is replaced.
            chosen = replace(chosen, points="", add=True)
        scene, seed = extract_scene(context=context), context.scene.rtgi.seed

        def place(progress: Progress):
            volumes = scattered_scene(scene, technique, settings, chosen, seed, None, progress)[0].volumes
            points = [tuple(point) for volume in volumes for point in volume.scattered.points_world]
            if len(points) > MOST:
                raise BakeError(f"{len(points):,} scattered probes are too many to be shown as Empties ({MOST:,})",
                                "bake them as they are, or lower the resolution of volumes")
            return points, _SIZE * spacing_of(volumes)

        return place

    def _done(self, found):
        points, size = found
        show(bpy.data.scenes[self._scene], points, size)
        self.report({"INFO"}, rpt_("{probes:,} scattered probes are shown").format(probes=len(points)))

    def _cancelled(self, outcome):
        return rpt_("Placement cancelled; what was shown before is kept")


class RTGI_OT_cancel_place_probes(CancelJob, bpy.types.Operator):
    """Stop placing probes. What was shown before is kept"""

    bl_idname = "rtgi.cancel_place_probes"
    bl_label = "Cancel Placement"
    job = placing


def show(scene: bpy.types.Scene, points, size: float) -> bpy.types.Collection:
    """Give ``scene`` the collection COLLECTION, with Empties of that ``size`` [m] at ``points`` and nothing else of its own."""
    collection = next((each for each in scene.collection.children_recursive if each.name == COLLECTION), None)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
        scene.collection.children.link(collection)
    for obj in [obj for obj in collection.objects if obj.type == "EMPTY"]:
        bpy.data.objects.remove(obj)
    for point in points:
        empty = bpy.data.objects.new("Probe", None)
        empty.empty_display_type, empty.empty_display_size, empty.location = "SPHERE", size, point
        collection.objects.link(empty)
    return collection


class RTGI_PT_render_placement(Closed, InRender, bpy.types.Panel):
    """Where probes stand."""

    bl_label = "Placement"
    bl_idname = "RTGI_PT_render_placement"
    bl_parent_id = "RTGI_PT_render"

    def draw(self, context):
        """The choice, and how probes are scattered."""
        layout, group = split(self.layout), context.scene.rtgi.scatter
        column = layout.column()
        column.enabled = not session.running
        column.prop(group, "placement")
        if group.placement != "scattered":
            return
        for item in fields(SCATTER.Settings):
            if item.name == "points":
                column.prop_search(group, "points", bpy.data, "collections", text=iface_(item.metadata["label"]))
            elif item.name == "add":
                row = column.row()
                row.active = bool(group.points)
                draw_setting(row, group, SCATTER, item)
            elif item.name != "placement":
                draw_setting(column, group, SCATTER, item)
        draw_job(layout, context, placing, lambda row: row.operator("rtgi.place_probes", icon="EMPTY_AXIS"),
                 "rtgi.cancel_place_probes")


_CLASSES = RTGI_OT_place_probes, RTGI_OT_cancel_place_probes, RTGI_PT_render_placement


def register() -> None:
    """Register the operators and the panel."""
    register_job(placing, *_CLASSES)


def unregister() -> None:
    """Take them out; a placement under way ends."""
    unregister_job(placing, *_CLASSES)
