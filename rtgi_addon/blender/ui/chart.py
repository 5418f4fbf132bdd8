"""Charts in Blender: an operator that measures on a worker thread, the ranking as a table in the sidebar, the picture as an image.

What was charted lives as long as this run of Blender, by scene name: its files are in the output folder, beside the bake.
"""

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...errors import BakeError
from ...evaluate.chart_data import Chart
from ...evaluate.pareto import pareto_front
from ...evaluate.pictures import PictureChart
from ...jobs.chart import chart_scene, check_chart
from ...jobs.plan_answer import spoken
from ...progress import Progress
from ...storage.workplace import can_resume
from ..extract import extract_scene, files_of_blend
from ..output import output_folder
from ..translations import sentence
from ..worker import Job
from .modal_job import CancelJob, ModalJob, register_job, unregister_job
from .panel_kinds import ToolPanel
from .sidebar import draw_job, draw_lines, draw_table
from .tool_settings import ToolSettings

# Rows of the table in the panel.
_MOST_ROWS = 10


@dataclass(eq=False)
class Charts(Job):
    """The chart under way and those that were made: the finished or latest partial ``Chart`` and the folder by scene name."""

    charts: dict[str, tuple[Chart, Path]] = field(default_factory=dict)

    def forget(self) -> None:
        """Drop the charts too."""
        super().forget()
        self.charts.clear()


charts = Charts()


class RTGI_OT_chart(ModalJob, bpy.types.Operator):
    """Bake this scene with every technique at several settings and chart their errors against time, rays and memory"""

    bl_idname = "rtgi.chart"
    bl_label = "Chart Techniques"
    bl_options = {"REGISTER"}
    job = charts
    noun = "chart"

    seeds: bpy.props.IntProperty(name="Seeds", description="Bakes of each setting, from which intervals follow", default=4, min=1,
                                 max=32)
    points: bpy.props.IntProperty(name="Surface Points", description="Points on surfaces where errors are measured", default=128,
                                  min=8, max=4096)
    noise: bpy.props.FloatProperty(name="Reference Noise", description="Relative noise at which the reference stops", default=0.01,
                                   min=0.001, max=0.2, precision=3)
    maps: bpy.props.BoolProperty(name="Error Maps", description="Also draw where in the scene each technique is wrong",
                                  default=True)
    reference: bpy.props.EnumProperty(name="Reference", description="What is held to be right", items=[
        ("path", "Path Tracer", "This add-on's own path tracer"),
        ("cycles", "Cycles", "Cycles, on the CPU; Blender waits while it renders")])
    pictures: bpy.props.BoolProperty(name="Pictures of Effects", default=False, description="Also hold pictures with "
                                     "effects to Cycles', through the scene's camera; Blender waits while it renders")
    resume: bpy.props.BoolProperty(name="Continue", description="Go on from what a cancelled run has measured",
                                   options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, context):
        """Not while another chart or a bake is running."""
        return cls._free(rpt_("A chart or a bake is already running"))

    def _work(self, context):
        scene = context.scene
        folder, name = check_chart(_folder_of(scene), files_of_blend()), scene.name
        extracted = extract_scene(context=context)
        reference = None
        if self.reference == "cycles":
            from ..cycles.receivers import CyclesReference
            reference = CyclesReference(self.noise, scene=scene)
        pictures = None
        if self.pictures:
            from ..cycles.pictures import CyclesPictures
            pictures = CyclesPictures(scene=scene)
        options = {"seeds": self.seeds, "points": self.points, "noise": self.noise, "reference": reference, "maps": self.maps,
                   "pictures": pictures, "resume": self.resume}

        def measure(progress: Progress):
            return chart_scene(extracted, folder, progress=progress, **options,
                               on_point=lambda chart: charts.charts.__setitem__(name, (chart, folder)))

        charts.charts.pop(name, None)
        return measure

    def _done(self, report):
        charts.charts[self._scene] = report.chart, report.folder
        if report.picture is not None:
            _load_image(report.picture)
        self.report({"INFO"}, rpt_("Charted {count} settings into {folder}").format(
            count=len(report.chart.points), folder=report.folder))

    def _cancelled(self, outcome):
        if self._scene in charts.charts:
            _load_image(charts.charts[self._scene][1] / "chart.png")
        return sentence(outcome.kept) or rpt_("Chart cancelled")


class RTGI_OT_cancel_chart(CancelJob, bpy.types.Operator):
    """Stop measuring. What was measured is kept"""

    bl_idname = "rtgi.cancel_chart"
    bl_label = "Cancel Chart"
    job = charts


class RTGI_PT_chart(ToolPanel, bpy.types.Panel):
    """Which technique gives what for which time."""

    bl_label = "Techniques Compared"

    def draw(self, context):
        """The button or its progress, and the settings ranked by error."""
        layout, width = self.layout, context.region.width

        SETTINGS.draw(layout, context.scene, not charts.running)

        def buttons(column):
            SETTINGS.give(column.operator("rtgi.chart", icon="GRAPH"), context.scene)
            with suppress(BakeError):
                if can_resume(_folder_of(context.scene)):
                    button = column.operator("rtgi.chart", text="Continue", icon="RECOVER_LAST")
                    SETTINGS.give(button, context.scene)
                    button.resume = True

        draw_job(layout, context, charts, buttons, "rtgi.cancel_chart")
        known = charts.charts.get(context.scene.name)
        if known is None:
            return
        chart, folder = known
        if not chart.complete and not charts.running:
            draw_lines(layout, iface_("Cancelled before the end"), width, "INFO")
        draw_table(layout, iface_("Error"), ranking(chart), "SOLO_ON")
        if chart.measured("atlas"):
            draw_table(layout, iface_("Error in the Light Atlas"), ranking(chart, "atlas"), "SOLO_ON")
        if chart.pictures is not None:
            draw_table(layout, iface_("Error of the Picture"), picture_ranking(chart.pictures), "SOLO_ON")
        draw_lines(layout, folder.name, width, "FILE_FOLDER")


def _folder_of(scene: bpy.types.Scene) -> Path:
    """Where the chart of ``scene`` goes: beside its bakes. Raises BakeError."""
    output = output_folder(scene.rtgi.output)
    return output.with_name(output.name + "_chart")


def ranking(chart: Chart, place: str = "surface") -> list[tuple[bool, str, str, str]]:
    """The settings of ``chart`` from the least error in ``place``: whether it is on the Pareto front, technique and setting, error,
    time."""
    front, points = set(chart.front("seconds", place)), list(enumerate(chart.points))
    order = sorted((entry for entry in points if place in entry[1].accuracy), key=lambda entry: entry[1].error(place))
    return [(index in front, f"{point.technique}, {point.label}", f"{100 * point.error(place):.2g}%", spoken(point.seconds.mean))
            for index, point in order[:_MOST_ROWS]]


def picture_ranking(pictures: PictureChart) -> list[tuple[bool, str, str, str]]:
    """The pictures of effects from the least error, as ``ranking`` has settings; what none beats in both stands out."""
    steps = [point.last for point in pictures.points]
    front = set(map(int, pareto_front([step.cpu_seconds for step in steps], [step.error for step in steps])))
    order = sorted(range(len(steps)), key=lambda index: steps[index].error)
    return [(index in front, f"{pictures.points[index].effect}, {pictures.points[index].label}", f"{100 * steps[index].error:.2g}%",
             spoken(steps[index].cpu_seconds)) for index in order[:_MOST_ROWS]]


def _load_image(path: Path) -> None:
    """The picture at ``path`` as the image of that name, replaced if an earlier chart is there."""
    if not path.is_file():
        return
    image = bpy.data.images.get("RTGI Chart")
    if image is None:
        image = bpy.data.images.load(str(path))
        image.name = "RTGI Chart"
    else:
        image.filepath = str(path)
        image.reload()


SETTINGS = ToolSettings("rtgi_chart", RTGI_OT_chart, ("seeds", "points", "noise", "reference", "maps", "pictures"))
_CLASSES = (RTGI_OT_chart, RTGI_OT_cancel_chart, RTGI_PT_chart)


def register() -> None:
    """Register operators and panel."""
    register_job(charts, *_CLASSES)
    SETTINGS.register()


def unregister() -> None:
    """Stop a running chart and take everything out."""
    SETTINGS.unregister()
    unregister_job(charts, *_CLASSES)
