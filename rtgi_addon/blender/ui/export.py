"""Exports in Blender: engine and folder, an operator that writes them on a worker thread, and its part of the sidebar."""

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...errors import BakeError
from ...exchange import engines
from ...exchange.engines import ExportReport
from ...jobs.export import export_bundle
from ...progress import Progress
from ...techniques import registry
from ..bundles import exported_bundle, record_of
from ..extract import files_of_blend
from ..model import Model, export_model
from ..session import session
from ..styles import STYLIZED
from ..translations import sentence
from ..worker import Job
from .effect_settings import chosen_effects
from .modal_job import CancelJob, ModalJob, register_job, unregister_job
from .panel_kinds import ToolPanel, split
from .sidebar import draw_job, draw_lines

_ENGINES = [(engine.name, engine.title, engine.description) for engine in engines.registry().values()]


@dataclass(eq=False)
class Exports(Job):
    """The export under way, and the reports of those that were made, by scene name."""

    reports: dict[str, ExportReport] = field(default_factory=dict)

    def forget(self) -> None:
        """Drop the reports too."""
        super().forget()
        self.reports.clear()


exports = Exports()


class RTGI_export_settings(bpy.types.PropertyGroup):
    """What the sidebar asks of an export, kept with the scene."""

    engine: bpy.props.EnumProperty(name="Engine", description="For which engine the probes are written", items=_ENGINES)
    part: bpy.props.EnumProperty(name="Part", description="How much of the export is written", items=[
        ("all", "Sample Project", "A project that runs as it is, with the probes in it"),
        ("files", "Probes Only", "The folder with the probes and what reads them, into a project of your own")])
    folder: bpy.props.StringProperty(name="Folder", description="Where the export goes; files of an earlier export there are "
                                                                "replaced, unless somebody changed them", subtype="DIR_PATH",
                                     default="//rtgi_export/", options={"PATH_SUPPORTS_BLEND_RELATIVE"})
    model: bpy.props.BoolProperty(
        name="Model", description="Write what renders of this scene as glTF into the sample scene, lit by the probes", default=True)
    style: bpy.props.BoolProperty(
        name="Style", default=True,
        description="Write the effect Stylized as it is set up, if it is on and the engine takes styles")


class RTGI_OT_export(ModalJob, bpy.types.Operator):
    """Write the last bake as textures, shaders and a sample scene of an engine"""

    bl_idname = "rtgi.export"
    bl_label = "Export to Engine"
    bl_options = {"REGISTER"}
    job = exports
    noun = "export"

    @classmethod
    def poll(cls, context):
        """With the bundle on disk that is shown, and not while something else is baked or written."""
        if not cls._free(rpt_("A bake or an export is already running")):
            return False
        try:
            exported_bundle(context.scene)
        except BakeError as error:
            cls.poll_message_set(sentence(str(error)))
            return False
        return True

    def _work(self, context):
        settings = context.scene.rtgi_export
        (bundle, manifest), engine, part = exported_bundle(context.scene), settings.engine, settings.part
        self._outdated = outdated(context.scene, manifest)
        folder, style = _target_folder(settings.folder), _style(context.scene, engine)
        engines.get(engine).check_target(folder, part, inputs=[bundle, *files_of_blend()])
        with ExitStack() as stack:
            model, made = None, Model((), (), (), None)
            if settings.model and part == "all":
                model = Path(stack.enter_context(TemporaryDirectory(prefix="rtgi"))) / "model.glb"
                made = export_model(model)
            # From here on the model is the worker's, to read and to remove.
            held = stack.pop_all()

        def write(progress: Progress):
            with held:
                return export_bundle(bundle, engine, folder, model=model, part=part, missing_lamps=made.missing,
                                     even_lamps=made.even, lost=made.lost, sky=made.sky, style=style, progress=progress)

        return write

    def _done(self, report):
        exports.reports[self._scene] = report
        if self._outdated:
            self.report({"WARNING"}, rpt_("What was exported is out of date: bake again"))
        for note in report.notes:
            self.report({"WARNING"}, sentence(note))
        for name in report.kept:
            self.report({"WARNING"}, rpt_("{name} was changed since the last export and stays as it is").format(name=name))
        text = rpt_("{count} files for {engine} in {folder}; README.md there says how to use them") \
            if "README.md" in report.files else rpt_("{count} files for {engine} in {folder}")
        self.report({"INFO"}, text.format(count=len(report.files), engine=report.title, folder=report.out))

    def _cancelled(self, outcome):
        return rpt_("Export cancelled; an earlier one is as it was")


def _style(scene: bpy.types.Scene, engine: str):
    """The settings of the effect Stylized, None where it is off, or not for ``engine``."""
    if not (scene.rtgi_export.style and engines.get(engine).styles):
        return None
    return next((entry.settings for entry in chosen_effects(scene) if entry.effect.name == STYLIZED), None)


def outdated(scene: bpy.types.Scene, manifest: dict) -> bool:
    """Whether ``scene`` is known to have changed since the bundle with ``manifest`` was baked."""
    state = manifest["stats"].get("state")
    return bool(session.stale.get(scene.name)) and state in ("", None, scene.rtgi.last_bake.fingerprint)


def draw_bundle(layout, scene: bpy.types.Scene, width: int) -> None:
    """Which bake goes, or why none does."""
    try:
        folder, manifest = exported_bundle(scene)
    except BakeError as error:
        draw_lines(layout, sentence(str(error)), width, "INFO")
        return
    technique, probes = registry()[manifest["technique"]].label, record_of(folder, manifest)["probes"]
    draw_lines(layout, f"{folder.name}: {iface_(technique)}, {iface_('{probes:,} probes').format(probes=probes)}", width,
               "FILE_FOLDER")
    if outdated(scene, manifest):
        draw_lines(layout, iface_("Out of date: the scene or its settings have changed since"), width, "ERROR")


def _target_folder(setting: str) -> Path:
    """The absolute folder of an export. Raises BakeError for none, and for one relative to a file that was never saved."""
    if not setting.strip():
        raise BakeError("no folder is set for the export", "choose one under Export in the sidebar")
    if setting.startswith("//") and not bpy.data.filepath:
        raise BakeError(f"the folder {setting} is relative to this file, which was never saved",
                        "save the file, or choose an absolute folder under Export in the sidebar")
    return Path(bpy.path.abspath(setting)).resolve()


class RTGI_OT_cancel_export(CancelJob, bpy.types.Operator):
    """Stop writing. An earlier export stays as it is"""

    bl_idname = "rtgi.cancel_export"
    bl_label = "Cancel Export"
    job = exports


class RTGI_PT_export(ToolPanel, bpy.types.Panel):
    """Where an export goes, and its button."""

    bl_label = "Export"

    def draw(self, context):
        """Engine, folder, whether the scene goes along, and the button."""
        layout = self.layout
        draw_bundle(layout, context.scene, context.region.width)
        split(layout)
        settings = context.scene.rtgi_export
        for name in ("engine", "part", "folder"):
            layout.prop(settings, name)
        row = layout.row()
        row.enabled = settings.part == "all"
        row.prop(settings, "model")
        row = layout.row()
        row.active = engines.get(settings.engine).styles
        row.prop(settings, "style")
        draw_job(layout, context, exports, lambda column: column.operator("rtgi.export", icon="EXPORT"), "rtgi.cancel_export")
        report = exports.reports.get(context.scene.name)
        if report is not None and not exports.running:
            draw_report(layout, report, context.region.width)


def draw_report(layout, report: ExportReport, width: int) -> None:
    """What the last export of this session did, and what of the scene it does not hold."""
    box = layout.box()
    draw_lines(box, iface_("{count} files in {folder}").format(count=len(report.files), folder=report.out.name), width, "CHECKMARK")
    for note in report.notes:
        draw_lines(box, sentence(note), width, "ERROR")
    for name in report.kept:
        draw_lines(box, iface_("{name} stays as somebody changed it").format(name=name), width, "INFO")


_CLASSES = (RTGI_export_settings, RTGI_OT_export, RTGI_OT_cancel_export, RTGI_PT_export)


def register() -> None:
    """Register settings, operator and panel."""
    register_job(exports, *_CLASSES)
    bpy.types.Scene.rtgi_export = bpy.props.PointerProperty(type=RTGI_export_settings)


def unregister() -> None:
    """Stop a running export and take everything out."""
    exports.stop()
    del bpy.types.Scene.rtgi_export
    unregister_job(exports, *_CLASSES)
