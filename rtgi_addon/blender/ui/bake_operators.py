"""What the user can do: bake, cancel, check, fit a volume, open the folder. Light is traced on a worker thread; all that touches
Blender happens here, on its main thread."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from mathutils import Matrix

from ...errors import BakeError
from ..bake_job import check, fitted_volume, last_bake_of, prepare, record
from ..extract.volumes import is_volume
from ..session import redraw, session
from ..worker import duration
from .modal_job import CancelJob, ModalJob, refuse, register_job, unregister_job


class RTGI_OT_bake(ModalJob, bpy.types.Operator):
    """Bake the light of this scene into its Light Probe Volumes"""

    bl_idname = "rtgi.bake"
    bl_label = "Bake Probes"
    bl_options = {"REGISTER"}
    job = session
    noun = "bake"

    @classmethod
    def poll(cls, context):
        """Not twice at a time."""
        return cls._free(rpt_("A bake is already running"))

    def _work(self, context):
        return prepare(context)

    def _done(self, summary):
        scene = bpy.data.scenes.get(self._scene)
        if scene is not None:
            record(scene, summary)
            # So that Blender asks whether to save the file, which remembers its last bake.
            if not bpy.app.background and bpy.ops.ed.undo_push.poll():
                bpy.ops.ed.undo_push(message="Bake Probes")
        done = last_bake_of(summary)
        text = rpt_("Baked {probes:,} probes in {time}, light on surfaces off by {error:.2g}%") if done["surface_error"] >= 0 else \
            rpt_("Baked {probes:,} probes in {time}")
        self.report({"INFO"}, text.format(probes=done["probes"], time=duration(done["seconds"]), error=100 * done["surface_error"]))

    def _cancelled(self, outcome):
        return rpt_("Bake cancelled; the last one is as it was")


class RTGI_OT_cancel(CancelJob, bpy.types.Operator):
    """Stop the bake. What was baked before stays as it is"""

    bl_idname = "rtgi.cancel"
    bl_label = "Cancel Bake"
    job = session


class RTGI_OT_check(bpy.types.Operator):
    """Read the scene as a bake would and list what would spoil it, and what of it is not followed"""

    bl_idname = "rtgi.check"
    bl_label = "Check Scene"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """As for a bake."""
        return RTGI_OT_bake.poll(context)

    def execute(self, context):
        """Fill the panel's list of findings."""
        try:
            findings = check(context)
        except BakeError as error:
            session.errors[context.scene.name] = str(error)
            return refuse(self, str(error))
        session.errors.pop(context.scene.name, None)
        count = sum(finding.severity != "note" for finding in findings)
        if count:
            text = rpt_("1 thing to look at") if count == 1 else rpt_("{count} things to look at").format(count=count)
        else:
            text = rpt_("Nothing stands in the way of a bake")
        self.report({"INFO"}, text)
        redraw()
        return {"FINISHED"}


class RTGI_OT_fit_volume(bpy.types.Operator):
    """Add a Light Probe Volume that fits the scene, with evenly spaced probes"""

    bl_idname = "rtgi.fit_volume"
    bl_label = "Add Fitted Volume"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """As for a bake."""
        return RTGI_OT_bake.poll(context)

    def execute(self, context):
        """Add the volume, select it and make it active."""
        try:
            fitted = fitted_volume(context)
        except BakeError as error:
            return refuse(self, str(error))
        probe = bpy.data.lightprobes.new("Probe Volume", "VOLUME")
        volume = bpy.data.objects.new(probe.name, probe)
        context.collection.objects.link(volume)
        for selected in context.selected_objects:
            selected.select_set(False)
        volume.select_set(True)
        context.view_layer.objects.active = volume
        return _place(self, volume, fitted, rpt_("Added {volume} with {x} × {y} × {z} = {probes:,} probes"))


class RTGI_OT_refit_volume(bpy.types.Operator):
    """Move and resize this Light Probe Volume so that it fits the scene, with evenly spaced probes"""

    bl_idname = "rtgi.refit_volume"
    bl_label = "Fit to Scene"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """With a volume as the active object, and as for a bake."""
        return context.object is not None and is_volume(context.object) and RTGI_OT_bake.poll(context)

    def execute(self, context):
        """Give it the box and the resolution."""
        try:
            fitted = fitted_volume(context)
        except BakeError as error:
            return refuse(self, str(error))
        return _place(self, context.object, fitted, rpt_("{volume} now has {x} × {y} × {z} = {probes:,} probes"))


def _place(operator, volume, fitted, text: str) -> set[str]:
    """Give ``volume`` the box and the lattice of ``fitted``, and say so."""
    probe = volume.data
    probe.resolution_x, probe.resolution_y, probe.resolution_z = nx, ny, nz = fitted.resolution
    # Of lists Blender takes the first for a column.
    volume.matrix_world = Matrix([list(row) for row in fitted.world_from_local])
    operator.report({"INFO"}, text.format(volume=volume.name, x=nx, y=ny, z=nz, probes=nx * ny * nz))
    return {"FINISHED"}


class RTGI_OT_open_folder(bpy.types.Operator):
    """Show the folder of the last bake in the system's file browser"""

    bl_idname = "rtgi.open_folder"
    bl_label = "Open Bake Folder"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        """Only where something was baked."""
        return bool(context.scene.rtgi.last_bake.folder)

    def execute(self, context):
        """Open it, if it is still there."""
        folder = Path(context.scene.rtgi.last_bake.folder)
        if not folder.is_dir():
            self.report({"ERROR"}, rpt_("{folder} is no longer there: bake again").format(folder=folder))
            return {"CANCELLED"}
        bpy.ops.wm.path_open(filepath=str(folder))
        return {"FINISHED"}


_CLASSES = (RTGI_OT_bake, RTGI_OT_cancel, RTGI_OT_check, RTGI_OT_fit_volume, RTGI_OT_refit_volume, RTGI_OT_open_folder)


def register() -> None:
    """Register the operators."""
    register_job(session, *_CLASSES)


def unregister() -> None:
    """Stop a running bake and take the operators out."""
    unregister_job(session, *_CLASSES)
