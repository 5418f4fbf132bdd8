"""Plans in Blender: an operator that measures on a worker thread, its sentences in the sidebar, and a button that applies them.

A plan lives as long as this run of Blender, by scene name.
"""

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..errors import BakeError
from ..evaluate.plan import Plan, Target
from ..evaluate.plan.reasons import percent, size
from ..evaluate.plan.search import upper
from ..jobs.plan import PlanReport, plan_scene
from ..progress import Progress
from .extract import extract_scene
from .extract.volumes import is_volume
from .modal_job import CancelJob, Job, ModalJob
from .motion import find_motion
from .panels import draw_job, draw_lines, draw_settings
from .properties import attribute
from .session import redraw, session
from .translations import sentence
from .worker import BakeWorker

_MIB = 1 << 20
# Rows of the table in the panel.
_MOST_ROWS = 8


class Plans(Job):
    """The plan under way: ``worker`` with the scene it is ``planning`` for; and those that were made, by scene name."""

    def __init__(self):
        super().__init__()
        self.planning = ""
        self.plans: dict[str, Plan] = {}


plans = Plans()


class RTGI_OT_plan(ModalJob, bpy.types.Operator):
    """Measure which technique, lattices, order and rays light the surfaces of this scene well enough for the least time"""

    bl_idname = "rtgi.plan"
    bl_label = "Plan Bake"
    bl_options = {"REGISTER"}
    job = plans

    error: bpy.props.FloatProperty(name="Error at Surfaces", description="Relative error of the light on surfaces that is aimed at",
                                   default=Target.error, min=0.001, max=1.0, precision=3)
    memory: bpy.props.IntProperty(name="Memory", description="MiB that the bake may take; 0 for any", default=0, min=0)
    keep_air: bpy.props.BoolProperty(name="Keep Air", description="Also bake probes that no surface reads, for things that move "
                                     "through the air", default=False)
    others: bpy.props.BoolProperty(name="Compare Techniques", description="Also measure what the other techniques would do",
                                   default=True)

    @classmethod
    def poll(cls, context):
        """Not while another plan or a bake is running."""
        if plans.running or session.running:
            cls.poll_message_set(rpt_("A plan or a bake is already running"))
            return False
        return context.mode == "OBJECT"

    def _prepared(self, context, on_report=None) -> BakeWorker | None:
        """The plan of this scene, ready to be made; None once a reason against it was reported."""
        name = context.scene.name
        try:
            self._require_ended("plan")
            extracted, motion = extract_scene(context=context), find_motion(context)
        except BakeError as error:
            self.report({"ERROR"}, sentence(str(error)))
            return None
        target = Target(self.error, self.memory * _MIB or None, keep_air=self.keep_air)
        seed, others = context.scene.rtgi.seed, self.others

        def plan(progress: Progress) -> PlanReport:
            return plan_scene(extracted, target, seed=seed, motion=motion, others=others, progress=progress)

        plans.worker, plans.planning = BakeWorker(plan, on_report), name
        return plans.worker

    def _finish(self):
        outcome = plans.worker.outcome
        redraw()
        if outcome.error:
            self.report({"ERROR"}, sentence(outcome.error))
            return {"CANCELLED"}
        if outcome.cancelled:
            self.report({"INFO"}, rpt_("Plan cancelled"))
            return {"CANCELLED"}
        plan = plans.plans[plans.planning] = outcome.summary.plan
        text = rpt_("Planned: {error} at surfaces with {probes:,} probes") if plan.met else \
            rpt_("Out of reach; the best there is: {error} at surfaces with {probes:,} probes")
        self.report({"INFO"}, text.format(error=percent(plan.chosen.error.value), probes=plan.probes))
        return {"FINISHED"}


class RTGI_OT_cancel_plan(CancelJob, bpy.types.Operator):
    """Stop planning. An earlier plan is kept"""

    bl_idname = "rtgi.cancel_plan"
    bl_label = "Cancel Plan"
    job = plans


class RTGI_OT_apply_plan(bpy.types.Operator):
    """Write the plan's technique and settings to this scene, and its resolutions to the Light Probe Volumes"""

    bl_idname = "rtgi.apply_plan"
    bl_label = "Apply Plan"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Only with a plan of this scene, and not while a bake reads it."""
        return context.scene.name in plans.plans and not session.running

    def execute(self, context):
        """Write it; a volume that was fitted for the plan is added first."""
        plan, settings = plans.plans[context.scene.name], context.scene.rtgi
        found = {obj.name: obj for obj in context.scene.objects if is_volume(obj)}
        for volume in plan.volumes:
            if volume.name not in found and volume.fitted and bpy.ops.rtgi.fit_volume() == {"FINISHED"}:
                found[volume.name] = context.view_layer.objects.active
            if volume.name not in found:
                self.report({"ERROR"}, rpt_("The volume {name} is no longer there: plan again").format(name=volume.name))
                return {"CANCELLED"}
        settings.technique = plan.technique
        group = getattr(settings, attribute(plan.technique))
        for name, value in plan.settings.items():
            setattr(group, name, value)
        if "error" in plan.settings:
            settings.mode = "ERROR"
        for volume in plan.volumes:
            data = found[volume.name].data
            data.resolution_x, data.resolution_y, data.resolution_z = volume.resolution
            own = getattr(data.rtgi, attribute(plan.technique))
            # What a volume does differently was not planned with.
            for name in own.bl_rna.properties.keys():
                if name.startswith("override_"):
                    setattr(own, name, False)
        redraw()
        self.report({"INFO"}, rpt_("Applied: {lattices} probes").format(lattices=size([v.resolution for v in plan.volumes])))
        return {"FINISHED"}


class RTGI_PT_plan(bpy.types.Panel):
    """What to bake, why, and what else there is."""

    bl_label = "Plan"
    bl_parent_id = "RTGI_PT_bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """The button or its progress, the plan's sentences, what else there is, and the button that applies it."""
        layout, width = self.layout, context.region.width
        if plans.running:
            draw_job(layout, plans, "rtgi.cancel_plan")
        else:
            layout.operator("rtgi.plan", icon="VIEWZOOM")
        plan = plans.plans.get(context.scene.name)
        if plan is None:
            return
        layout.operator("rtgi.apply_plan", icon="CHECKMARK")
        for line in plan.reasons:
            draw_lines(layout, sentence(line), width, "DOT")
        draw_settings(layout, iface_("Error below"), rows(plan), "CHECKMARK")


def rows(plan: Plan) -> list[tuple[bool, str, str, str]]:
    """What is planned and what else there is: whether it meets the target, what it is, the error that is not passed, and time."""
    shown = [option for option in plan.options if not option.why_not][:_MOST_ROWS]
    return [(option.meets, f"{option.technique}, {option.label}, {size(option.resolutions)}", percent(upper(option.error)),
             f"{option.price.seconds:.2g} s") for option in shown]


@bpy.app.handlers.persistent
def forget_plans(*_):
    """Another file is about to be opened: stop planning, and drop what belongs to the old one's scenes."""
    if plans.worker is not None:
        plans.worker.cancel()
    plans.plans.clear()


_CLASSES = (RTGI_OT_plan, RTGI_OT_cancel_plan, RTGI_OT_apply_plan, RTGI_PT_plan)


def register() -> None:
    """Register operators, panel and handler."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.app.handlers.load_pre.append(forget_plans)


def unregister() -> None:
    """Stop a running plan, give it a moment to end, and take everything out."""
    plans.stop()
    plans.plans.clear()
    bpy.app.handlers.load_pre.remove(forget_plans)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
