"""The light atlas in the interface: which objects are in it, by which UV map, and how it is baked."""

from dataclasses import fields, replace

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...effects.atlas.settings import ATLAS
from ...effects.atlas.uneven import uneven
from ...effects.atlas.unwrapped import USUAL
from ...errors import BakeError
from ...exchange.atlas_files import INDEX
from ..atlas_materials import remove, set_up, shows_atlas
from ..bundles import bundle_folders
from ..extract import extract_scene
from ..session import session
from ..translations import sentence
from ..unwrap import fit_islands, unwrap
from ..worker import Job
from .modal_job import CancelJob, ModalJob, register_job, unregister_job
from .panel_kinds import Closed, InObject, InRender, split
from .panels import draw_setting
from .properties import atlas_settings
from .role_properties import atlas_map
from .sidebar import draw_job

fitting = Job()


class RTGI_OT_unwrap_atlas(bpy.types.Operator):
    """Give the selected meshes a UV map for the light atlas, called Lightmap: no overlaps, islands apart by its texels"""

    bl_idname = "rtgi.unwrap_atlas"
    bl_label = "Unwrap for Light Atlas"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Object mode, with a mesh."""
        return context.mode == "OBJECT" and context.object is not None and context.object.type == "MESH"

    def execute(self, context):
        """Unwrap them, and put them into the atlas; meshes that several objects share once."""
        chosen = [obj for obj in context.selected_objects if obj.type == "MESH"] or [context.object]
        editable = [obj for obj in chosen if obj.data.library is None and len(obj.data.polygons)]
        if not editable:
            self.report({"WARNING"}, rpt_("No mesh among the selected objects can be unwrapped"))
            return {"CANCELLED"}
        done = set()
        for obj in editable:
            if obj.data not in done:
                unwrap(context, obj, context.scene.rtgi.atlas.density)
                done.add(obj.data)
            obj.rtgi.atlas, obj.rtgi.atlas_uv = True, ""
        self.report({"INFO"}, rpt_("Unwrapped {0} meshes for the light atlas").format(len(done)))
        return {"FINISHED"}


class RTGI_OT_fit_atlas(ModalJob, bpy.types.Operator):
    """Give more of the texels of maps unwrapped for the light atlas to islands whose light is uneven, as two coarse bakes tell"""

    bl_idname = "rtgi.fit_atlas"
    bl_label = "Fit Islands to Light"
    bl_options = {"REGISTER", "UNDO"}
    job = fitting
    noun = "fit of the light atlas"

    @classmethod
    def poll(cls, context):
        """Object mode, while nothing else traces rays."""
        return context.mode == "OBJECT" and cls._free(rpt_("A bake or another fit is already running"))

    def _work(self, context):
        meshes = _to_fit(context.scene)
        if not meshes:
            raise BakeError("no object has a map of Unwrap for Light Atlas that could be fitted to light",
                            "select objects and unwrap them for the light atlas")
        names = {obj.name for objects in meshes.values() for obj in objects}
        scene, settings, seed = extract_scene(context=context), atlas_settings(context.scene), context.scene.rtgi.seed
        # Maps of other objects are no concern of it.
        scene = replace(scene, instances=tuple(each if each.name in names else replace(each, atlas=None)
                                               for each in scene.instances))
        return lambda progress: uneven(scene, settings, seed, None, progress)

    def _done(self, found):
        scene, count = bpy.data.scenes[self._scene], 0
        told = {part.name for part in found.sheet.parts}
        for objects in _to_fit(scene).values():
            names = [obj.name for obj in objects if obj.name in told and obj.name in bpy.context.view_layer.objects]
            if names:
                # Of objects that share a mesh the one whose light is the least even decides.
                fit_islands(bpy.context, bpy.data.objects[names[0]], scene.rtgi.atlas.density,
                            lambda uv, names=names: np.fmax.reduce([found.of(name, uv) for name in names]))
                count += 1
        self.report({"INFO"}, rpt_("Fitted the islands of {0} meshes to their light").format(count))

    def _cancelled(self, outcome):
        return rpt_("Fit cancelled; maps are as they were")


class RTGI_OT_cancel_fit_atlas(CancelJob, bpy.types.Operator):
    """Stop measuring light. Maps stay as they are"""

    bl_idname = "rtgi.cancel_fit_atlas"
    bl_label = "Cancel Fit"
    job = fitting


def _to_fit(scene: bpy.types.Scene) -> dict:
    """Of meshes whose map is the operator's, the objects of ``scene`` in the light atlas that read it."""
    meshes = {}
    for obj in scene.objects:
        if (obj.type == "MESH" and not obj.hide_render and atlas_map(obj) in ("", USUAL) and obj.data.library is None
                and USUAL in obj.data.uv_layers):
            meshes.setdefault(obj.data, []).append(obj)
    return meshes


class RTGI_OT_show_atlas(bpy.types.Operator):
    """Let EEVEE show the baked light atlas: materials of its objects get an output for EEVEE alone that reads its images"""

    bl_idname = "rtgi.show_atlas"
    bl_label = "Show in Materials"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Set the materials up for the last bake, again after every other one."""
        folder = next((place for place in bundle_folders(context.scene) if (place / INDEX).is_file()), None)
        if folder is None:
            self.report({"ERROR"}, rpt_("No light atlas is baked: switch objects on for it, and bake"))
            return {"CANCELLED"}
        try:
            done = set_up(context.scene, folder)
        except BakeError as error:
            self.report({"ERROR"}, sentence(str(error)))
            return {"CANCELLED"}
        for note in done.notes:
            self.report({"WARNING"}, sentence(note))
        told = rpt_("{0} materials of {1} objects show the light atlas in EEVEE")
        self.report({"INFO"}, told.format(done.materials, done.objects))
        return {"FINISHED"}


class RTGI_OT_hide_atlas(bpy.types.Operator):
    """Take the nodes that show the light atlas out of all materials"""

    bl_idname = "rtgi.hide_atlas"
    bl_label = "Remove from Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only where there are some."""
        return shows_atlas(context.scene)

    def execute(self, context):
        """Leave materials as they were."""
        self.report({"INFO"}, rpt_("Removed from {0} materials").format(remove(context.scene)))
        return {"FINISHED"}


class RTGI_PT_object_atlas(Closed, InObject, bpy.types.Panel):
    """Whether an object's light is in the atlas, and by which UV map."""

    bl_label = "Light Atlas"
    bl_idname = "RTGI_PT_object_atlas"
    bl_parent_id = "RTGI_PT_object"

    @classmethod
    def poll(cls, context):
        """Meshes: what else is drawn has no UV maps to choose from."""
        return getattr(context, "object", None) is not None and context.object.type == "MESH"

    def draw_header(self, context):
        """The switch."""
        self.layout.enabled = not session.running
        self.layout.prop(context.object.rtgi, "atlas", text="")

    def draw(self, context):
        """The map, and how to get one."""
        column, obj = split(self.layout).column(), context.object
        column.enabled, column.active = not session.running, obj.rtgi.atlas
        column.prop_search(obj.rtgi, "atlas_uv", obj.data, "uv_layers", icon="GROUP_UVS")
        column.operator(RTGI_OT_unwrap_atlas.bl_idname, icon="UV")


class RTGI_PT_render_atlas(Closed, InRender, bpy.types.Panel):
    """How the light atlas is baked."""

    bl_label = "Light Atlas"
    bl_idname = "RTGI_PT_render_atlas"
    bl_parent_id = "RTGI_PT_render"

    def draw(self, context):
        """How many objects are in it, and its settings."""
        layout, group = split(self.layout), context.scene.rtgi.atlas
        count = sum(atlas_map(obj) is not None and not obj.hide_render for obj in context.scene.objects)
        text = iface_("{count} objects in the light atlas").format(count=count) if count else iface_(
            "No object: switch Light Atlas on in Object > RTGI")
        layout.label(text=text, translate=False, icon="UV" if count else "INFO")
        column = layout.column()
        column.enabled, column.active = not session.running, count > 0
        for item in fields(ATLAS.Settings):
            draw_setting(column, group, ATLAS, item)
        if count:
            draw_job(layout, context, fitting, lambda row: row.operator(RTGI_OT_fit_atlas.bl_idname, icon="UV_ISLANDSEL"),
                     RTGI_OT_cancel_fit_atlas.bl_idname)
        row = layout.row(align=True)
        row.enabled = not session.running
        row.operator(RTGI_OT_show_atlas.bl_idname, icon="MATERIAL")
        row.operator(RTGI_OT_hide_atlas.bl_idname, text="", icon="X")


_CLASSES = (RTGI_OT_unwrap_atlas, RTGI_OT_fit_atlas, RTGI_OT_cancel_fit_atlas, RTGI_OT_show_atlas, RTGI_OT_hide_atlas,
            RTGI_PT_object_atlas, RTGI_PT_render_atlas)


def register() -> None:
    """Register the operators and the panels."""
    register_job(fitting, *_CLASSES)


def unregister() -> None:
    """Take them out; a fit under way ends."""
    unregister_job(fitting, *_CLASSES)
