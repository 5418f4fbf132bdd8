"""The stability suite in Blender: an operator that measures on a worker thread, and its report as a text data-block."""

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ... import effects, techniques
from ...errors import BakeError
from ...evaluate.stability import ABOVE, CASES, HOLDS, WORSE, StabilityReport, chosen, own_cases
from ...jobs.stability import check_stability, run_stability
from ...progress import Progress
from ...storage.workplace import can_resume
from ..extract import extract_scene, files_of_blend
from ..output import output_folder
from ..translations import sentence
from ..worker import Job
from .modal_job import CancelJob, ModalJob, register_job, unregister_job
from .panel_kinds import ToolPanel
from .sidebar import draw_job, draw_lines

_TEXT = "RTGI Stability"
# The share of the table's width that names take.
_NAME_SHARE = 0.7
# Blender keeps no reference to the items of a dynamic enumeration.
_items: list[tuple[str, str, str]] = []


@dataclass(eq=False)
class Suite(Job):
    """The test under way; what was last ``asked`` for: technique, and whether on this scene; and the ``reports`` that were made, by
    scene name."""

    asked: tuple[str, bool] = ("all", True)
    reports: dict[str, StabilityReport] = field(default_factory=dict)

    def forget(self) -> None:
        """Drop the reports too."""
        super().forget()
        self.reports.clear()


suite = Suite()


def _techniques(_self, _context):
    _items[:] = [("all", "All Techniques", "Every technique, which takes some minutes"),
                 *((technique.name, technique.label, technique.description) for technique in techniques.registry().values()),
                 *((effect.name, effect.label, effect.description) for effect in effects.registry().values()
                   if any(effect.name in case.limits for case in CASES.values()))]
    return _items


class RTGI_OT_stability(ModalJob, bpy.types.Operator):
    """Bake this scene with its volumes and lamps moved, or built-in ones in which methods are known to fail, and report what \
changed that should not have"""

    bl_idname = "rtgi.stability"
    bl_label = "Test Stability"
    bl_options = {"REGISTER"}
    job = suite
    noun = "run"

    technique: bpy.props.EnumProperty(name="Technique", description="Which technique is tested", items=_techniques)
    case: bpy.props.StringProperty(name="Case", description="Only the case of this name; all if empty")
    own: bpy.props.BoolProperty(name="This Scene", default=True, description="Test this scene instead of the built-in ones")
    resume: bpy.props.BoolProperty(name="Continue", description="Go on from what a cancelled run has measured",
                                   options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context):
        """Not while something else is measured or baked."""
        return cls._free(rpt_("A bake or a measurement is already running"))

    def _work(self, context):
        cases = [self.case] if self.case else None
        wanted = None if self.technique == "all" else [self.technique]
        folder = check_stability(_folder_of(context.scene), files_of_blend())
        scene = extract_scene(context=context) if self.own else None
        chosen(cases, wanted, own_cases(scene) if self.own else CASES)

        resume, suite.asked = self.resume, (self.technique, self.own)

        def measure(progress: Progress):
            return run_stability(folder, scene, cases=cases, techniques=wanted, resume=resume, progress=progress)

        return measure

    def _done(self, report):
        suite.reports[self._scene] = report
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

    def _cancelled(self, outcome):
        return sentence(outcome.kept) or rpt_("Stability test cancelled")


class RTGI_OT_cancel_stability(CancelJob, bpy.types.Operator):
    """Stop testing. What was measured is kept"""

    bl_idname = "rtgi.cancel_stability"
    bl_label = "Cancel Test"
    job = suite


class RTGI_PT_stability(ToolPanel, bpy.types.Panel):
    """The stability suite's button."""

    bl_label = "Stability"

    def draw(self, context):
        """The buttons for this scene and for the built-in ones; which text holds the report."""
        layout = self.layout

        def buttons(column):
            for text, technique in ((iface_("Test This Scene"), context.scene.rtgi.technique),
                                    (iface_("This Scene, All Techniques"), "all")):
                button = column.operator("rtgi.stability", text=text, translate=False)
                button.technique, button.own = technique, True
            with suppress(BakeError):
                if can_resume(_folder_of(context.scene)):
                    button = column.operator("rtgi.stability", text="Continue", icon="RECOVER_LAST")
                    button.technique, button.own = suite.asked
                    button.resume = True

        draw_job(layout, context, suite, buttons, "rtgi.cancel_stability")
        report = suite.reports.get(context.scene.name)
        if report is not None and not suite.running:
            draw_verdicts(layout, report, context.region.width)
        if _TEXT in bpy.data.texts:
            layout.operator("rtgi.open_report", icon="TEXT")


def draw_verdicts(layout, report: StabilityReport, width: int) -> None:
    """A line for each figure: whether it holds, what it is and what was allowed; below those that do not, what helps."""
    several = len({result.technique for result in report.results}) > 1
    for result in report.results:
        holds = result.verdict == HOLDS
        name = iface_("{case} of {technique}").format(case=result.case.name, technique=result.technique) if several else \
            result.case.name
        allowed = result.case.goal if result.case.remedies is not None else result.limit.bound
        row = layout.split(factor=_NAME_SHARE)
        row.label(text=name, translate=False, icon="CHECKMARK" if holds else "ERROR")
        row.label(text=iface_("{figure:.2g} of {allowed:.2g}").format(figure=result.figure, allowed=allowed), translate=False)
        if not holds and result.limit.why:
            draw_lines(layout, sentence(result.limit.why), width, "BLANK1")


class RTGI_OT_open_report(bpy.types.Operator):
    """Show the report of the last stability test in a text editor"""

    bl_idname = "rtgi.open_report"
    bl_label = "Open Report"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        """Only with a report."""
        return _TEXT in bpy.data.texts

    def execute(self, context):
        """In a text editor that is open, or in a window of its own."""
        editor = next((area for window in context.window_manager.windows for area in window.screen.areas
                       if area.type == "TEXT_EDITOR"), None)
        if editor is None:
            if bpy.app.background:
                self.report({"INFO"}, rpt_("The report is the text {text!r}").format(text=_TEXT))
                return {"FINISHED"}
            bpy.ops.wm.window_new()
            editor = context.window_manager.windows[-1].screen.areas[0]
            editor.type = "TEXT_EDITOR"
        editor.spaces.active.text = bpy.data.texts[_TEXT]
        editor.spaces.active.top = 0
        return {"FINISHED"}


def _folder_of(scene: bpy.types.Scene) -> Path:
    """Where the report on ``scene`` goes: beside its bakes. Raises BakeError."""
    output = output_folder(scene.rtgi.output)
    return output.with_name(output.name + "_stability")


_CLASSES = (RTGI_OT_stability, RTGI_OT_cancel_stability, RTGI_OT_open_report, RTGI_PT_stability)


def register() -> None:
    """Register operator and panel."""
    register_job(suite, *_CLASSES)


def unregister() -> None:
    """Stop a running test and take everything out."""
    unregister_job(suite, *_CLASSES)
