"""The stability suite in Blender: an operator that measures on a worker thread, and its report as a text data-block."""

import bpy

from .. import techniques
from ..errors import BakeError
from ..progress import Progress
from . import dependencies
from .bake_job import output_folder
from .modal_job import GRACE, ModalJob
from .session import redraw, session
from .worker import BakeWorker

_TEXT = "RTGI Stability"
# Blender keeps no reference to the items of a dynamic enumeration.
_items: list[tuple[str, str, str]] = []


class Suite:
    """The run under way: its ``worker``, None before the first."""

    def __init__(self):
        self.worker: BakeWorker | None = None

    @property
    def running(self) -> bool:
        """True while something is measured."""
        return self.worker is not None and self.worker.running


suite = Suite()


def _techniques(_self, _context):
    _items[:] = [("all", "All Techniques", "Every technique, which takes some minutes"),
                 *((technique.name, technique.label, technique.description) for technique in techniques.registry().values())]
    return _items


class RTGI_OT_stability(ModalJob, bpy.types.Operator):
    """Bake the built-in scenes in which methods of global illumination are known to fail, and report how much ours do"""

    bl_idname = "rtgi.stability"
    bl_label = "Test Stability"
    bl_options = {"REGISTER"}
    job = suite

    technique: bpy.props.EnumProperty(name="Technique", description="Which technique is tested", items=_techniques)
    case: bpy.props.StringProperty(name="Case", description="Only the case of this name; all if empty")

    @classmethod
    def poll(cls, context):
        """Not while something else is measured or baked."""
        if suite.running or session.running:
            cls.poll_message_set("A bake or a measurement is already running")
            return False
        return True

    def _prepared(self, context, on_report=None) -> bool:
        """Whether there is now a worker that can run; a reason against it was reported."""
        try:
            self._require_ended("run")
            dependencies.require()
            from ..evaluate.stability import chosen  # needs embreex, without which the add-on still registers
            from ..jobs.stability import run_stability
            cases = [self.case] if self.case else None
            wanted = None if self.technique == "all" else [self.technique]
            chosen(cases, wanted)
            output = output_folder(context.scene.rtgi.output)
            folder = output.with_name(output.name + "_stability")
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return False

        def measure(progress: Progress):
            return run_stability(folder, cases=cases, techniques=wanted, progress=progress)

        suite.worker = BakeWorker(measure, on_report)
        return True

    def _finish(self):
        outcome = suite.worker.outcome
        redraw()
        if outcome.error:
            self.report({"ERROR"}, outcome.error)
            return {"CANCELLED"}
        if outcome.cancelled:
            self.report({"INFO"}, "Stability test cancelled; what was measured is beside the bake's folder")
            return {"CANCELLED"}
        report = outcome.summary
        text = bpy.data.texts.get(_TEXT) or bpy.data.texts.new(_TEXT)
        text.from_string(report.to_markdown())
        worse = [f"{result.case.name} of {result.technique}" for result in report.worse]
        if worse:
            self.report({"WARNING"}, f"Worse than their bounds: {', '.join(worse)}. See the text {_TEXT!r}")
        else:
            self.report({"INFO"}, f"{len(report.results)} figures within their bounds. See the text {_TEXT!r} and {report.out}")
        return {"FINISHED"}


class RTGI_PT_stability(bpy.types.Panel):
    """The stability suite's button."""

    bl_label = "Stability"
    bl_parent_id = "RTGI_PT_bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """The button for the scene's technique and the one for all of them; which text holds the report."""
        layout = self.layout
        layout.operator("rtgi.stability", text="Test This Technique").technique = context.scene.rtgi.technique
        layout.operator("rtgi.stability", text="Test All").technique = "all"
        if _TEXT in bpy.data.texts:
            layout.label(text=_TEXT, icon="TEXT")


_CLASSES = (RTGI_OT_stability, RTGI_PT_stability)


def register() -> None:
    """Register operator and panel."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Stop a running test, give it a moment to end, and take everything out."""
    if suite.worker is not None:
        suite.worker.cancel()
        suite.worker.join(GRACE)
        suite.worker = None
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
