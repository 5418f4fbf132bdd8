"""The stability suite in Blender: an operator that measures on a worker thread, and its report as a text data-block."""

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from .. import techniques
from ..errors import BakeError
from ..evaluate.stability import ABOVE, CASES, WORSE, chosen, own_cases
from ..jobs.stability import run_stability
from ..progress import Progress
from .bake_job import output_folder
from .extract import extract_scene
from .modal_job import Job, ModalJob
from .session import redraw, session
from .translations import sentence
from .worker import BakeWorker

_TEXT = "RTGI Stability"
# Blender keeps no reference to the items of a dynamic enumeration.
_items: list[tuple[str, str, str]] = []


suite = Job()


def _techniques(_self, _context):
    _items[:] = [("all", "All Techniques", "Every technique, which takes some minutes"),
                 *((technique.name, technique.label, technique.description) for technique in techniques.registry().values())]
    return _items


class RTGI_OT_stability(ModalJob, bpy.types.Operator):
    """Bake this scene with its volumes and lamps moved, or built-in ones in which methods are known to fail, and report what \
changed that should not have"""

    bl_idname = "rtgi.stability"
    bl_label = "Test Stability"
    bl_options = {"REGISTER"}
    job = suite

    technique: bpy.props.EnumProperty(name="Technique", description="Which technique is tested", items=_techniques)
    case: bpy.props.StringProperty(name="Case", description="Only the case of this name; all if empty")
    own: bpy.props.BoolProperty(name="This Scene", default=True, description="Test this scene instead of the built-in ones")

    @classmethod
    def poll(cls, context):
        """Not while something else is measured or baked."""
        if suite.running or session.running:
            cls.poll_message_set(rpt_("A bake or a measurement is already running"))
            return False
        return True

    def _prepared(self, context, on_report=None) -> bool:
        """Whether there is now a worker that can run; a reason against it was reported."""
        try:
            self._require_ended("run")
            cases = [self.case] if self.case else None
            wanted = None if self.technique == "all" else [self.technique]
            scene = extract_scene(context=context) if self.own else None
            chosen(cases, wanted, own_cases(scene) if self.own else CASES)
            output = output_folder(context.scene.rtgi.output)
            folder = output.with_name(output.name + "_stability")
        except BakeError as error:
            self.report({"ERROR"}, sentence(str(error)))
            return False

        def measure(progress: Progress):
            return run_stability(folder, scene, cases=cases, techniques=wanted, progress=progress)

        suite.worker = BakeWorker(measure, on_report)
        return True

    def _finish(self):
        outcome = suite.worker.outcome
        redraw()
        if outcome.error:
            self.report({"ERROR"}, sentence(outcome.error))
            return {"CANCELLED"}
        if outcome.cancelled:
            self.report({"INFO"}, rpt_("Stability test cancelled; what was measured is beside the bake's folder"))
            return {"CANCELLED"}
        report = outcome.summary
        text = bpy.data.texts.get(_TEXT) or bpy.data.texts.new(_TEXT)
        text.from_string(report.to_markdown())
        failed = [result for result in report.results if result.verdict in (WORSE, ABOVE)]
        listed = ", ".join(rpt_("{case} of {technique}").format(case=result.case.name, technique=result.technique)
                           for result in failed)
        if not failed:
            self.report({"INFO"}, rpt_("{count} figures hold. See the text {text!r} and {folder}").format(
                count=len(report.results), text=_TEXT, folder=report.out))
        elif self.own:
            self.report({"INFO"}, rpt_("{failed} of {count} figures are above their goals: {listed}. The text {text!r} says what "
                                       "helps").format(failed=len(failed), count=len(report.results), listed=listed, text=_TEXT))
        else:
            self.report({"WARNING"}, rpt_("Worse than their bounds: {listed}. See the text {text!r}").format(
                listed=listed, text=_TEXT))
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
        """The buttons for this scene and for the built-in ones; which text holds the report."""
        layout = self.layout
        for text, technique, own in ((iface_("Test This Scene"), context.scene.rtgi.technique, True),
                                     (iface_("This Scene, All Techniques"), "all", True),
                                     (iface_("Built-in Scenes"), "all", False)):
            button = layout.operator("rtgi.stability", text=text, translate=False)
            button.technique, button.own = technique, own
        if _TEXT in bpy.data.texts:
            layout.label(text=_TEXT, translate=False, icon="TEXT")


_CLASSES = (RTGI_OT_stability, RTGI_PT_stability)


def register() -> None:
    """Register operator and panel."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Stop a running test, give it a moment to end, and take everything out."""
    suite.stop()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
