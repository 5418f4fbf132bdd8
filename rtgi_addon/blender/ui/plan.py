"""Plans in Blender: an operator that measures on a worker thread, its sentences in the sidebar, and a button that applies them.

A plan lives as long as this run of Blender, by scene name.
"""

from dataclasses import dataclass, field

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...errors import BakeError
from ...evaluate.plan import Plan, Target
from ...evaluate.plan.reasons import percent, size
from ...evaluate.plan.tries import upper
from ...jobs.plan import PlanReport, plan_scene
from ...jobs.plan_answer import answer, by_rays, spoken
from ...progress import Progress
from ..apply_plan import apply_plan
from ..extract import extract_scene
from ..motion import find_motion
from ..session import redraw, session
from ..translations import sentence
from ..worker import Job
from .modal_job import CancelJob, ModalJob, refuse, register_job, unregister_job
from .panel_kinds import Closed, InSidebar, ToolPanel
from .sidebar import draw_job, draw_lines, draw_table
from .tool_settings import ToolSettings

_MIB = 1 << 20
# Rows of the table in the panel.
_MOST_ROWS = 8


@dataclass(eq=False)
class Plans(Job):
    """The plan under way, and those that were made, by scene name."""

    plans: dict[str, Plan] = field(default_factory=dict)

    def forget(self) -> None:
        """Drop the plans too."""
        super().forget()
        self.plans.clear()


plans = Plans()


class RTGI_OT_plan(ModalJob, bpy.types.Operator):
    """Measure which technique, lattices, order and rays light the surfaces of this scene well enough for the least time"""

    bl_idname = "rtgi.plan"
    bl_label = "Plan Bake"
    bl_options = {"REGISTER"}
    job = plans
    noun = "plan"

    error: bpy.props.FloatProperty(name="Error at Surfaces", description="Relative error of the light on surfaces that is aimed at",
                                   default=Target.error, min=0.001, max=1.0, precision=3)
    memory: bpy.props.IntProperty(name="Memory", description="MiB that the bake may take; 0 for any", default=0, min=0)
    keep_air: bpy.props.BoolProperty(name="Keep Air", description="Also bake probes that no surface reads, for things that move "
                                     "through the air", default=False)
    nested: bpy.props.BoolProperty(name="Nested Volumes", description="Look for finer volumes within coarser ones that do as well "
                                   "with fewer probes, even where that takes longer than it saves", default=False)
    fit: bpy.props.BoolProperty(name="Fit to Surfaces", description="Plan probes that are fitted to how surfaces and moving things "
                                "read them, as few as that allows", default=False)
    others: bpy.props.BoolProperty(name="Compare Techniques", description="Also measure what the other techniques would do",
                                   default=True)

    @classmethod
    def poll(cls, context):
        """Not while another plan or a bake is running."""
        return cls._free(rpt_("A plan or a bake is already running"))

    def _work(self, context):
        extracted, motion = extract_scene(context=context), find_motion(context)
        target = Target(self.error, self.memory * _MIB or None, keep_air=self.keep_air, nested=self.nested, fit=self.fit)
        seed, others = context.scene.rtgi.seed, self.others

        def plan(progress: Progress) -> PlanReport:
            return plan_scene(extracted, target, seed=seed, motion=motion, others=others, progress=progress)

        return plan

    def _done(self, report):
        plan = plans.plans[self._scene] = report.plan
        text = rpt_("Planned: {error} at surfaces with {probes:,} probes") if plan.met else \
            rpt_("Out of reach; the best there is: {error} at surfaces with {probes:,} probes")
        self.report({"INFO"}, text.format(error=percent(plan.chosen.error.value), probes=plan.probes))

    def _cancelled(self, outcome):
        return rpt_("Plan cancelled")


class RTGI_OT_cancel_plan(CancelJob, bpy.types.Operator):
    """Stop planning. An earlier plan is kept"""

    bl_idname = "rtgi.cancel_plan"
    bl_label = "Cancel Plan"
    job = plans


class RTGI_OT_apply_plan(bpy.types.Operator):
    """Write the plan to this scene: technique, settings, resolutions and left out probes of its volumes, and those within others"""

    bl_idname = "rtgi.apply_plan"
    bl_label = "Apply Plan"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only with a plan of this scene, and not while a bake reads it."""
        return context.scene.name in plans.plans and not session.running

    def execute(self, context):
        """Write it; a volume that was fitted for the plan is added first."""
        plan = plans.plans[context.scene.name]
        try:
            apply_plan(context.scene, plan)
        except BakeError as error:
            return refuse(self, str(error))
        redraw()
        self.report({"INFO"}, rpt_("Applied: {lattices} probes").format(lattices=size([v.resolution for v in plan.volumes])))
        return {"FINISHED"}


class RTGI_PT_plan(ToolPanel, bpy.types.Panel):
    """What to bake, why, and what else there is."""

    bl_label = "Plan"

    def draw(self, context):
        """What is asked for, the button or its progress, the plan's answer, and the button that applies it."""
        layout, width = self.layout, context.region.width
        SETTINGS.draw(layout, context.scene, not plans.running)
        draw_job(layout, context, plans, lambda column: SETTINGS.give(column.operator("rtgi.plan", icon="VIEWZOOM"), context.scene),
                 "rtgi.cancel_plan")
        plan = plans.plans.get(context.scene.name)
        if plan is None:
            return
        for line, icon in zip(answer(plan), ("LIGHTPROBE_VOLUME", "CHECKMARK" if plan.met else "ERROR", "TIME"), strict=True):
            draw_lines(layout, sentence(line), width, icon)
        layout.operator("rtgi.apply_plan", icon="CHECKMARK")


class _OfPlan(Closed, InSidebar):
    """Mixed into what is folded away below a plan's answer."""

    bl_parent_id = "RTGI_PT_plan"

    @classmethod
    def poll(cls, context):
        """Only with a plan."""
        return context.scene.name in plans.plans


class RTGI_PT_plan_reasons(_OfPlan, bpy.types.Panel):
    """Why the plan is what it is."""

    bl_label = "Why"

    def draw(self, context):
        """The plan's sentences."""
        plan = plans.plans[context.scene.name]
        for line in (*plan.reasons, *filter(None, [by_rays(plan)])):
            draw_lines(self.layout, sentence(line), context.region.width, "DOT")


class RTGI_PT_plan_options(_OfPlan, bpy.types.Panel):
    """What else there is."""

    bl_label = "What Else There Is"

    def draw(self, context):
        """A table of settings."""
        draw_table(self.layout, iface_("Error below"), rows(plans.plans[context.scene.name]), "CHECKMARK")


def rows(plan: Plan) -> list[tuple[bool, str, str, str]]:
    """What is planned and what else there is: whether it meets the target, what it is, the error that is not passed, and time."""
    shown = [option for option in plan.options if not option.why_not][:_MOST_ROWS]
    return [(option.meets, f"{option.technique}, {option.label}, {size(option.resolutions)}", percent(upper(option.error)),
             spoken(option.price.seconds)) for option in shown]


SETTINGS = ToolSettings("rtgi_plan", RTGI_OT_plan, ("error", "memory", "keep_air", "nested", "fit", "others"))
_CLASSES = (RTGI_OT_plan, RTGI_OT_cancel_plan, RTGI_OT_apply_plan, RTGI_PT_plan, RTGI_PT_plan_reasons, RTGI_PT_plan_options)


def register() -> None:
    """Register operators and panel."""
    register_job(plans, *_CLASSES)
    SETTINGS.register()


def unregister() -> None:
    """Stop a running plan and take everything out."""
    SETTINGS.unregister()
    unregister_job(plans, *_CLASSES)
