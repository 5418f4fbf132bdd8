"""Charts in Blender: an operator that measures on a worker thread, the ranking as a table in the sidebar, the picture as an image.

What was charted lives as long as this run of Blender, by scene name: its files are in the output folder, beside the bake.
"""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..errors import BakeError
from ..evaluate.chart_data import Chart
from ..jobs.chart import chart_scene
from ..progress import Progress
from .bake_job import output_folder
from .extract import extract_scene
from .modal_job import CancelJob, Job, ModalJob
from .panels import draw_job, draw_lines, draw_settings
from .session import redraw, session
from .translations import sentence
from .worker import BakeWorker, duration

# Rows of the table in the panel.
_MOST_ROWS = 10


class Charts(Job):
    """The chart under way and those that were made: ``worker`` with the scene it is for, the finished or latest partial ``Chart``
    and the folder by scene name."""

    def __init__(self):
        super().__init__()
        self.charting = ""
        self.folder: Path | None = None
        self.charts: dict[str, tuple[Chart, Path]] = {}


charts = Charts()


class RTGI_OT_chart(ModalJob, bpy.types.Operator):
    """Bake this scene with every technique at several settings and chart their errors against time, rays and memory"""

    bl_idname = "rtgi.chart"
    bl_label = "Chart Techniques"
    bl_options = {"REGISTER"}
    job = charts

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

    @classmethod
    def poll(cls, context):
        """Not while another chart or a bake is running."""
        if charts.running or session.running:
            cls.poll_message_set(rpt_("A chart or a bake is already running"))
            return False
        return context.mode == "OBJECT"

    def _prepared(self, context, on_report=None) -> BakeWorker | None:
        """The chart of this scene, ready to be measured; None once a reason against it was reported."""
        scene = context.scene
        try:
            self._require_ended("chart")
            charts.folder = output_folder(scene.rtgi.output).with_name(output_folder(scene.rtgi.output).name + "_chart")
            extracted = extract_scene(context=context)
            reference = None
            if self.reference == "cycles":
                from .cycles_receivers import CyclesReference
                reference = CyclesReference(self.noise, scene=scene)
        except BakeError as error:
            self.report({"ERROR"}, sentence(str(error)))
            return None
        folder, name = charts.folder, scene.name
        options = {"seeds": self.seeds, "points": self.points, "noise": self.noise, "reference": reference, "maps": self.maps}

        def measure(progress: Progress):
            return chart_scene(extracted, folder, progress=progress, **options,
                               on_point=lambda chart: charts.charts.__setitem__(name, (chart, folder)))

        charts.worker, charts.charting = BakeWorker(measure, on_report), name
        charts.charts.pop(name, None)
        return charts.worker

    def _finish(self):
        outcome, name = charts.worker.outcome, charts.charting
        charts.charting = ""
        redraw()
        if outcome.error:
            self.report({"ERROR"}, sentence(outcome.error))
            return {"CANCELLED"}
        if outcome.cancelled:
            kept = charts.charts.get(name)
            if not kept:
                self.report({"INFO"}, rpt_("Chart cancelled"))
            else:
                self.report({"INFO"}, rpt_("Chart cancelled; {count} settings are in {folder}").format(
                    count=len(kept[0].points), folder=kept[1]))
                _load_image(kept[1] / "chart.png")
            return {"CANCELLED"}
        report = outcome.summary
        charts.charts[name] = report.chart, report.folder
        if report.picture is not None:
            _load_image(report.picture)
        self.report({"INFO"}, sentence(report.hint) or rpt_("Charted {count} settings into {folder}").format(
            count=len(report.chart.points), folder=report.folder))
        return {"FINISHED"}


class RTGI_OT_cancel_chart(CancelJob, bpy.types.Operator):
    """Stop measuring. What was measured is kept"""

    bl_idname = "rtgi.cancel_chart"
    bl_label = "Cancel Chart"
    job = charts


class RTGI_PT_chart(bpy.types.Panel):
    """Which technique gives what for which time."""

    bl_label = "Techniques Compared"
    bl_parent_id = "RTGI_PT_bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """The button or its progress, and the settings ranked by error."""
        layout, width = self.layout, context.region.width
        if charts.running:
            draw_job(layout, charts, "rtgi.cancel_chart")
        else:
            layout.operator("rtgi.chart", icon="GRAPH")
        known = charts.charts.get(context.scene.name)
        if known is None:
            return
        chart, folder = known
        if not chart.complete and not charts.running:
            draw_lines(layout, iface_("Cancelled before the end"), width, "INFO")
        draw_settings(layout, iface_("Error"), ranking(chart), "SOLO_ON")
        draw_lines(layout, folder.name, width, "FILE_FOLDER")


def ranking(chart: Chart) -> list[tuple[bool, str, str, str]]:
    """The settings of ``chart`` from the least error: whether it is on the Pareto front, technique and setting, error, time."""
    front = set(chart.front())
    order = sorted(range(len(chart.points)), key=lambda index: chart.points[index].error())
    rows = []
    for index in order[:_MOST_ROWS]:
        point = chart.points[index]
        rows.append((index in front, f"{point.technique}, {point.label}", f"{100 * point.error():.2g}%",
                     f"{point.seconds.mean:.2g} s" if point.seconds.mean < 10 else duration(point.seconds.mean)))
    return rows


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


@bpy.app.handlers.persistent
def forget_charts(*_):
    """Another file is about to be opened: stop measuring, and drop what belongs to the old one's scenes."""
    if charts.worker is not None:
        charts.worker.cancel()
    charts.charts.clear()


_CLASSES = (RTGI_OT_chart, RTGI_OT_cancel_chart, RTGI_PT_chart)


def register() -> None:
    """Register operators, panel and handler."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.app.handlers.load_pre.append(forget_charts)


def unregister() -> None:
    """Stop a running chart, give it a moment to end, and take everything out."""
    charts.stop()
    charts.charts.clear()
    bpy.app.handlers.load_pre.remove(forget_charts)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
