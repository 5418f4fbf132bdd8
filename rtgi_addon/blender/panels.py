"""Where the user finds it: settings in the render properties and on the probe volume, actions in the 3D view's sidebar."""

import textwrap
from dataclasses import fields
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..techniques import registry
from ..transport.rays import slow_rays_warning
from .preset_ui import RTGI_PT_presets
from .progress_text import bar_text, step_text
from .properties import GOALS, attribute, has_goal, value_type
from .session import session
from .translations import sentence
from .worker import duration

# Mean width of a letter of the interface's font [px], and how few go on a line however narrow the region is.
_LETTER, _FEWEST_LETTERS = 6.6, 24
_ICONS = {"error": "CANCEL", "warning": "ERROR", "note": "INFO"}


def draw_job(layout, job, cancel: str) -> None:
    """How far a running ``job`` (modal_job.Job) is, and the button of the operator that stops it."""
    row = layout.row(align=True)
    row.progress(factor=job.worker.report.fraction, type="BAR", translate=False,
                 text=bar_text(job.worker.report, job.worker.progress.cancelled))
    row.operator(cancel, text="", icon="CANCEL")


def draw_settings(layout, error: str, rows: list[tuple[bool, str, str, str]], icon: str) -> None:
    """A table of settings: name, error (``error`` is its heading) and time; ``icon`` before those that are marked."""
    column = layout.column(align=True)
    for marked, name, value, time in [(False, iface_("Setting"), error, iface_("Time")), *rows]:
        row = column.split(factor=0.62)
        row.label(text=name, translate=False, icon=icon if marked else "BLANK1")
        cells = row.row()
        cells.label(text=value, translate=False)
        cells.label(text=time, translate=False)


def draw_lines(layout, text: str, width: int, icon: str = "NONE") -> None:
    """``text``, in the user's language already, over as many labels as a region of ``width`` pixels needs; the icon stands before
    the first."""
    scale = bpy.context.preferences.system.ui_scale or 1.0  # 0 without a window
    characters = max(int((width - 60) / (_LETTER * scale)), _FEWEST_LETTERS)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, characters) or [""]):
        column.label(text=line, translate=False, icon=icon if number == 0 else ("NONE" if icon == "NONE" else "BLANK1"))


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def draw_slow_rays(layout, width: int) -> None:
    """Say so where there is no Embree, before the user waits for a bake."""
    warning = slow_rays_warning()
    if warning:
        draw_lines(layout.box(), _sentence(sentence(warning)), width, "INFO")


def draw_actions(layout, context, width: int) -> None:
    """The Bake button, or the bake's progress with the button that stops it."""
    if not session.running:
        row = layout.row()
        row.scale_y = 1.5
        row.operator("rtgi.bake", icon="LIGHTPROBE_VOLUME")
        error = session.errors.get(context.scene.name)
        if error:
            box = layout.box()
            box.alert = True
            draw_lines(box, sentence(error), width, "CANCEL")
        return
    report = session.worker.report
    stopping = session.worker.progress.cancelled
    column = layout.column(align=True)
    row = column.row(align=True)
    row.scale_y = 1.5
    row.progress(factor=report.fraction, type="BAR", text=bar_text(report, stopping), translate=False)
    button = row.row(align=True)
    button.enabled = not stopping
    button.operator("rtgi.cancel", text="", icon="CANCEL")
    step = step_text(report)
    draw_lines(layout, step if session.baking == context.scene.name else f"{session.baking}: {step}", width, "SORTTIME")


def draw_volumes(layout, context, width: int) -> None:
    """How many probes the scene's volumes have, or that there are none and what will happen."""
    volumes = [obj for obj in context.scene.objects
               if obj.type == "LIGHT_PROBE" and obj.data.type == "VOLUME" and not obj.hide_render]
    if not volumes:
        draw_lines(layout, iface_("No Light Probe Volume: one will be fitted to the scene"), width, "INFO")
        layout.operator("rtgi.fit_volume", icon="ADD")
        return
    count = sum(obj.data.resolution_x * obj.data.resolution_y * obj.data.resolution_z for obj in volumes)
    text = iface_("{probes:,} probes in 1 volume") if len(volumes) == 1 else iface_("{probes:,} probes in {volumes} volumes")
    layout.label(text=text.format(probes=count, volumes=len(volumes)), translate=False, icon="OUTLINER_OB_LIGHTPROBE")


def draw_setting(layout, group, technique, item, toggle: str | None = None) -> None:
    """One setting in a split layout; ``toggle`` names the property that switches it on."""
    if toggle is None and value_type(technique, item.name)[1] and item.name not in GOALS:
        toggle = f"use_{item.name}"
    if toggle is None:
        layout.prop(group, item.name)
        return
    row = layout.row(heading=item.metadata["label"])
    row.prop(group, toggle, text="")
    value = row.row()
    value.active = getattr(group, toggle)
    value.prop(group, item.name, text="")


class RTGI_PT_render(bpy.types.Panel):
    """Settings of the scene's bake."""

    bl_label = "RTGI"
    bl_idname = "RTGI_PT_render"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, context):
        """The popover of presets."""
        RTGI_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        """Technique, when to stop, the technique's own settings."""
        layout, settings = self.layout, context.scene.rtgi
        width = context.region.width
        draw_slow_rays(layout, width)
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.enabled = not session.running
        technique = registry()[settings.technique]
        group = getattr(settings, attribute(technique.name))
        column.prop(settings, "technique")
        if "gpu" in technique.devices:
            column.prop(settings, "device")
        if has_goal(technique):
            column.row().prop(settings, "mode", expand=True)
            column.prop(group, "error" if settings.mode == "ERROR" else "rays")
        for item in fields(technique.Settings):
            if not (has_goal(technique) and item.name in GOALS):
                draw_setting(column, group, technique, item)


class RTGI_PT_render_output(bpy.types.Panel):
    """Where the bake goes."""

    bl_label = "Output"
    bl_parent_id = "RTGI_PT_render"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    def draw(self, context):
        """Folder, seed and the button."""
        layout, settings = self.layout, context.scene.rtgi
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.enabled = not session.running
        column.prop(settings, "output", text="Folder")
        column.prop(settings, "seed")
        draw_actions(layout, context, context.region.width)


class RTGI_PT_volume(bpy.types.Panel):
    """What one Light Probe Volume does differently."""

    bl_label = "RTGI Overrides"
    bl_idname = "RTGI_PT_volume"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        """Light Probe Volumes only, in any engine."""
        probe = getattr(context, "lightprobe", None)
        return probe is not None and probe.type == "VOLUME"

    def draw(self, context):
        """Every setting with a switch before it."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        technique = registry()[context.scene.rtgi.technique]
        group = getattr(context.lightprobe.rtgi, attribute(technique.name))
        column = layout.column()
        column.enabled = not session.running
        for item in fields(technique.Settings):
            draw_setting(column, group, technique, item, toggle=f"override_{item.name}")


class RTGI_PT_bake(bpy.types.Panel):
    """The actions, and what is baked."""

    bl_label = "Light Probes"
    bl_idname = "RTGI_PT_bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"

    def draw(self, context):
        """Volumes, Bake or its progress."""
        width = context.region.width
        draw_slow_rays(self.layout, width)
        draw_volumes(self.layout, context, width)
        draw_actions(self.layout.column(), context, width)


class RTGI_PT_last_bake(bpy.types.Panel):
    """What is baked, how good it is, and whether it still holds."""

    bl_label = "Last Bake"
    bl_parent_id = "RTGI_PT_bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"

    def draw(self, context):
        """The figures of the last bake."""
        layout, last = self.layout, context.scene.rtgi.last_bake
        if not last.folder:
            layout.label(text="Nothing baked yet", icon="INFO")
            return
        width = context.region.width
        if session.stale.get(context.scene.name):
            draw_lines(layout, iface_("The scene or its settings have changed since"), width, "ERROR")
        folder = Path(last.folder)
        figures = [
            (iface_("Probes"), f"{last.probes:,}"),
            (iface_("Usable"), f"{100 * last.usable:.1f}%"),
            (iface_("Estimated Error"), f"{100 * last.error:.2g}%" if last.error >= 0 else iface_("unknown")),
            (iface_("Time"), duration(last.seconds)),
        ]
        column = layout.column(align=True)
        for name, value in figures:
            row = column.split(factor=0.5)
            row.label(text=name, translate=False)
            row.label(text=value, translate=False)
        row = layout.row(align=True)
        row.label(text=folder.name, translate=False, icon="FILE_FOLDER")
        row.operator("rtgi.open_folder", text="", icon="FILEBROWSER")


class RTGI_PT_checks(bpy.types.Panel):
    """What would spoil a bake."""

    bl_label = "Checks"
    bl_parent_id = "RTGI_PT_bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"

    def draw(self, context):
        """Findings of the last reading; drawing reads nothing itself."""
        layout = self.layout
        findings = session.findings.get(context.scene.name)
        for finding in findings or ():
            draw_lines(layout, sentence(finding.text), context.region.width, _ICONS[finding.severity])
        if findings is not None and not findings:
            layout.label(text="Nothing to report", icon="CHECKMARK")
        layout.operator("rtgi.check", icon="VIEWZOOM")


_CLASSES = (RTGI_PT_render, RTGI_PT_render_output, RTGI_PT_volume, RTGI_PT_bake, RTGI_PT_last_bake, RTGI_PT_checks)


def register() -> None:
    """Register the panels."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Take them out."""
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
