"""Exports in Blender: engine and folder, an operator that writes them on a worker thread, and its part of the sidebar."""

from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..errors import BakeError
from ..exchange import engines
from ..jobs.export import export_bundle
from ..progress import Progress
from .bake_job import output_folder
from .modal_job import Job, ModalJob
from .model import export_model
from .session import redraw, session
from .translations import sentence
from .worker import BakeWorker

_ENGINES = [(engine.name, engine.title, engine.description) for engine in engines.registry().values()]


class Exports(Job):
    """The export under way: its ``worker``, None before the first, and the ``folder`` of the model that goes into it."""

    def __init__(self):
        super().__init__()
        self.folder: TemporaryDirectory | None = None

    def forget_model(self) -> None:
        """Remove the model's file."""
        if self.folder is not None:
            self.folder.cleanup()
            self.folder = None


exports = Exports()


class RTGI_export_settings(bpy.types.PropertyGroup):
    """What the sidebar asks of an export, kept with the scene."""

    engine: bpy.props.EnumProperty(name="Engine", description="For which engine the probes are written", items=_ENGINES)
    folder: bpy.props.StringProperty(name="Folder", description="Where the export goes; an earlier export there is replaced",
                                     subtype="DIR_PATH", default="//rtgi_export/", options={"PATH_SUPPORTS_BLEND_RELATIVE"})
    model: bpy.props.BoolProperty(
        name="Model", description="Write what renders of this scene as glTF into the sample scene, lit by the probes", default=True)


class RTGI_OT_export(ModalJob, bpy.types.Operator):
    """Write the last bake as textures, shaders and a sample scene of an engine"""

    bl_idname = "rtgi.export"
    bl_label = "Export to Engine"
    bl_options = {"REGISTER"}
    job = exports

    @classmethod
    def poll(cls, context):
        """With a bundle on disk, and not while something else is baked or written."""
        if exports.running or session.running:
            cls.poll_message_set(rpt_("A bake or an export is already running"))
            return False
        try:
            baked = (output_folder(context.scene.rtgi.output) / "bake.json").is_file()
        except BakeError:
            baked = False
        if not baked:
            cls.poll_message_set(rpt_("Bake first: there is nothing in the output folder"))
        return baked

    def _prepared(self, context, on_report=None) -> bool:
        """Whether there is now a worker that can run; a reason against it was reported."""
        settings = context.scene.rtgi_export
        try:
            self._require_ended("export")
            bundle, engine = output_folder(context.scene.rtgi.output), settings.engine
            folder = _target_folder(settings.folder)
            engines.get(engine).check_target(folder)
            model, notes = None, ()
            if settings.model:
                exports.folder = TemporaryDirectory(prefix="rtgi")
                model = Path(exports.folder.name) / "model.glb"
                notes = export_model(model)
        except BakeError as error:
            exports.forget_model()
            self.report({"ERROR"}, sentence(str(error)))
            return False

        def write(progress: Progress):
            return export_bundle(bundle, engine, folder, model=model, model_notes=notes, progress=progress)

        exports.worker = BakeWorker(write, on_report)
        return True

    def _finish(self):
        outcome = exports.worker.outcome
        exports.forget_model()
        redraw()
        if outcome.error:
            self.report({"ERROR"}, sentence(outcome.error))
            return {"CANCELLED"}
        if outcome.cancelled:
            self.report({"INFO"}, rpt_("Export cancelled; an earlier one is as it was"))
            return {"CANCELLED"}
        report = outcome.summary
        for note in report.notes:
            self.report({"WARNING"}, sentence(note))
        self.report({"INFO"}, rpt_("{count} files for {engine} in {folder}; README.md there says how to use them").format(
            count=len(report.files), engine=report.title, folder=report.out))
        return {"FINISHED"}


def _target_folder(setting: str) -> Path:
    """The absolute folder of an export. Raises BakeError for none, and for one relative to a file that was never saved."""
    if not setting.strip():
        raise BakeError("no folder is set for the export", "choose one under Export in the sidebar")
    if setting.startswith("//") and not bpy.data.filepath:
        raise BakeError(f"the folder {setting} is relative to this file, which was never saved",
                        "save the file, or choose an absolute folder under Export in the sidebar")
    return Path(bpy.path.abspath(setting)).resolve()


class RTGI_PT_export(bpy.types.Panel):
    """Where an export goes, and its button."""

    bl_label = "Export"
    bl_parent_id = "RTGI_PT_bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Engine, folder, whether the scene goes along, and the button."""
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        settings = context.scene.rtgi_export
        for name in ("engine", "folder", "model"):
            layout.prop(settings, name)
        layout.operator("rtgi.export", icon="EXPORT")


_CLASSES = (RTGI_export_settings, RTGI_OT_export, RTGI_PT_export)


def register() -> None:
    """Register settings, operator and panel."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.rtgi_export = bpy.props.PointerProperty(type=RTGI_export_settings)


def unregister() -> None:
    """Stop a running export, give it a moment to end, and take everything out."""
    exports.stop()
    exports.forget_model()
    del bpy.types.Scene.rtgi_export
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
