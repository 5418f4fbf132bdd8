"""Verification in Blender: the button in *Checks*, and what came out as lines that select what they are about.

What was verified lives as long as this run of Blender, by scene name.
"""

from dataclasses import dataclass, field

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...evaluate.verify.suspects import MATERIAL, WORLD
from ...jobs.verify import VerifyReport, difference_text, verify
from ...progress import Progress
from ..cycles.patches import CyclesPatches
from ..engine.shown import shown_for
from ..extract import extract_scene
from ..session import Finding, session
from ..translations import sentence
from ..worker import Job
from .modal_job import CancelJob, ModalJob, register_job, unregister_job
from .panel_kinds import InSidebar
from .sidebar import draw_job, draw_lines


@dataclass(eq=False)
class Verifications(Job):
    """The verification under way; and the reports that were made, by scene name."""

    reports: dict[str, VerifyReport] = field(default_factory=dict)

    def forget(self) -> None:
        """Drop the reports too."""
        super().forget()
        self.reports.clear()


verifications = Verifications()


class RTGI_OT_verify(ModalJob, bpy.types.Operator):
    """Compare what is read of this scene, and its bake, with Cycles at a few places, and find what makes a difference"""

    bl_idname = "rtgi.verify"
    bl_label = "Verify with Cycles"
    bl_options = {"REGISTER"}
    job = verifications
    noun = "verification"

    @classmethod
    def poll(cls, context):
        """Not while another verification or a bake is running."""
        return cls._free(rpt_("A verification or a bake is already running"))

    def _work(self, context):
        scene = context.scene
        extracted = extract_scene(context=context)
        judge = CyclesPatches(extracted, scene=scene, view_layer=context.view_layer)
        shown = shown_for(scene)
        baked = None if shown.live is not None or session.stale.get(scene.name) else shown.field
        verifications.reports.pop(scene.name, None)

        def measure(progress: Progress) -> VerifyReport:
            return verify(extracted, judge, baked, progress=progress)

        return measure

    def _done(self, report):
        verifications.reports[self._scene] = report
        self.report({"INFO"} if report.agrees else {"WARNING"},
                    sentence(report.verdict if report.agrees else str(report.refusal)))

    def _cancelled(self, outcome):
        return rpt_("Verification cancelled")


class RTGI_OT_cancel_verify(CancelJob, bpy.types.Operator):
    """Stop the verification"""

    bl_idname = "rtgi.cancel_verify"
    bl_label = "Cancel Verification"
    job = verifications


class RTGI_PT_verify(InSidebar, bpy.types.Panel):
    """The end of *Checks*: the button, and what came out."""

    bl_label = "Against Cycles"
    bl_parent_id = "RTGI_PT_checks"
    bl_options = {"HIDE_HEADER"}

    def draw(self, context):
        """The button or its progress, the verdict, and a line for each culprit and each omission; a click selects it."""
        layout = self.layout
        draw_job(layout, context, verifications, lambda row: row.operator("rtgi.verify", icon="CHECKMARK"), "rtgi.cancel_verify")
        report = verifications.reports.get(context.scene.name)
        for line in () if report is None else lines(report):
            draw_lines(layout, line.text, context.region.width, "CHECKMARK" if line.severity == "note" else "ERROR", line)


def lines(report: VerifyReport) -> list[Finding]:
    """What a report says, in the user's language, with what each line is about."""
    if report.agrees:
        return [Finding("note", sentence(report.verdict))]
    found = [Finding("warning", sentence(f"{report.verdict}: {report.reason}"))]
    for culprit in report.culprits:
        suspect = culprit.suspect
        text = iface_("Without {name}: {difference}").format(
            name=suspect.name or iface_("the world"), difference=difference_text(culprit.remaining.figure))
        names = () if suspect.kind == WORLD else (suspect.name,)
        found.append(Finding("warning", text, () if suspect.kind == MATERIAL else names, names if suspect.kind == MATERIAL else ()))
    return found + [Finding("warning", sentence(str(concern)), concern.omission.objects, concern.omission.materials)
                    for concern in report.not_followed]


_CLASSES = (RTGI_OT_verify, RTGI_OT_cancel_verify, RTGI_PT_verify)


def register() -> None:
    """Register operators and panel."""
    register_job(verifications, *_CLASSES)


def unregister() -> None:
    """Stop a running verification and take everything out."""
    unregister_job(verifications, *_CLASSES)
