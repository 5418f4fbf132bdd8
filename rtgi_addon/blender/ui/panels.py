"""Where the user finds it: settings in the render properties and on the probe volume, actions in the 3D view's sidebar."""

from dataclasses import fields
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...techniques import registry
from ...transport.rays.choose import slow_rays_warning
from ..session import session
from ..translations import sentence
from ..worker import duration
from .panel_kinds import Closed, InData, InRender, InSidebar, is_basic, split
from .presets import RTGI_PT_presets
from .properties import GOALS, OBJECT, attribute, has_goal, place_of, value_type
from .sidebar import draw_job, draw_lines

# Height of the row with the button that bakes.
_ACTION_HEIGHT = 1.5
_ICONS = {"error": "CANCEL", "warning": "ERROR", "note": "INFO"}


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def draw_slow_rays(layout, width: int) -> None:
    """Say so where there is no Embree, or no compiled kernels, before the user waits for a bake."""
    warning = slow_rays_warning()
    if warning:
        draw_lines(layout.box(), _sentence(sentence(warning)), width, "INFO")


def draw_actions(layout, context) -> None:
    """The Bake button, or the bake's progress with the button that stops it."""
    draw_job(layout, context, session, lambda row: row.operator("rtgi.bake", icon="LIGHTPROBE_VOLUME"), "rtgi.cancel",
             _ACTION_HEIGHT)


def draw_volumes(layout, context, width: int) -> None:
    """How many probes the scene's volumes have and how far apart, or that there are none and what will happen."""
    volumes = [obj for obj in context.scene.objects
               if obj.type == "LIGHT_PROBE" and obj.data.type == "VOLUME" and not obj.hide_render]
    if not volumes:
        draw_lines(layout, iface_("No Light Probe Volume: one will be fitted to the scene"), width, "INFO")
        layout.operator("rtgi.fit_volume", icon="ADD")
        return
    count = sum(obj.data.resolution_x * obj.data.resolution_y * obj.data.resolution_z for obj in volumes)
    text = iface_("{probes:,} probes in 1 volume") if len(volumes) == 1 else iface_("{probes:,} probes in {volumes} volumes")
    row = layout.row(align=True)
    row.label(text=text.format(probes=count, volumes=len(volumes)), translate=False, icon="OUTLINER_OB_LIGHTPROBE")
    active = getattr(context, "object", None)
    if active in volumes:
        row.operator("rtgi.refit_volume", text="", icon="CUBE")
    if active in volumes or len(volumes) == 1:
        layout.label(text=density(active if active in volumes else volumes[0]), translate=False, icon="BLANK1")


def density(volume) -> str:
    """How far apart the probes of a volume object are along its axes."""
    counts = volume.data.resolution_x, volume.data.resolution_y, volume.data.resolution_z
    sides = [2.0 * volume.matrix_world.col[axis].xyz.length / counts[axis] for axis in range(3)]
    return iface_("{x:.3g} × {y:.3g} × {z:.3g} m per probe").format(x=sides[0], y=sides[1], z=sides[2])


def draw_setting(layout, group, technique, item, toggle: str | None = None) -> None:
    """One setting in a split layout; ``toggle`` names the property that switches it on."""
    if toggle is None and value_type(technique, item.name)[1] and item.name not in GOALS:
        toggle = f"use_{item.name}"
    if item.metadata.get("or_object"):
        layout = layout.column(align=True)
    if toggle is None:
        layout.prop(group, place_of(item), text=item.metadata["label"])
    else:
        row = layout.row(heading=item.metadata["label"])
        row.prop(group, toggle, text="")
        layout = row.column()
        layout.active = getattr(group, toggle)
        layout.prop(group, place_of(item), text="")
    if item.metadata.get("or_object") and getattr(group, place_of(item)) == OBJECT:
        layout.prop_search(group, item.name, bpy.data, "objects", text="")


class RTGI_PT_render(Closed, InRender, bpy.types.Panel):
    """Settings of the scene's bake."""

    bl_label = "RTGI"
    bl_idname = "RTGI_PT_render"

    def draw_header_preset(self, context):
        """The popover of presets."""
        RTGI_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        """Technique, when to stop, what of the technique's own settings everybody sets."""
        settings, width = context.scene.rtgi, context.region.width
        draw_slow_rays(self.layout, width)
        column = split(self.layout).column()
        column.enabled = not session.running
        technique = registry()[settings.technique]
        group = getattr(settings, attribute(technique.name))
        column.prop(settings, "technique")
        if "gpu" in technique.devices:
            column.prop(settings, "device")
        if has_goal(technique):
            column.row().prop(settings, "mode", expand=True)
            column.prop(group, "error" if settings.mode == "ERROR" else "rays")
        for item in _settings(technique, basic=True):
            draw_setting(column, group, technique, item)


class RTGI_PT_render_advanced(Closed, InRender, bpy.types.Panel):
    """The technique's other settings."""

    bl_label = "Advanced"
    bl_parent_id = "RTGI_PT_render"

    def draw(self, context):
        """What most people never touch."""
        settings = context.scene.rtgi
        column = split(self.layout).column()
        column.enabled = not session.running
        technique = registry()[settings.technique]
        for item in _settings(technique, basic=False):
            draw_setting(column, getattr(settings, attribute(technique.name)), technique, item)
        column.prop(settings, "seed")


def _settings(technique, basic: bool) -> list:
    """The fields of the technique's Settings that are shown: those for everybody or those for experts."""
    return [item for item in fields(technique.Settings) if is_basic(technique, item.name) == basic
            and not (has_goal(technique) and item.name in GOALS)]


class RTGI_PT_render_output(InRender, bpy.types.Panel):
    """Where the bake goes."""

    bl_label = "Output"
    bl_parent_id = "RTGI_PT_render"

    def draw(self, context):
        """Folder and the button."""
        column = split(self.layout).column()
        column.enabled = not session.running
        column.prop(context.scene.rtgi, "output", text="Folder")
        draw_actions(self.layout, context)


class _OfVolume(InData):
    """Mixed into panels of Light Probe Volumes."""

    @classmethod
    def poll(cls, context):
        """Light Probe Volumes only."""
        probe = getattr(context, "lightprobe", None)
        return probe is not None and probe.type == "VOLUME"


class RTGI_PT_probe(_OfVolume, bpy.types.Panel):
    """The settings of a volume that count, where RTGI is the engine: others' panels have some that do nothing here."""

    bl_label = "Probe"
    bl_idname = "RTGI_PT_probe"

    @classmethod
    def poll(cls, context):
        """Our engine only."""
        return super().poll(context) and context.engine == "RTGI"

    def draw(self, context):
        """Resolution with the distance that comes of it, and what is captured."""
        layout, probe = split(self.layout), context.lightprobe
        column = layout.column(align=True)
        column.enabled = not session.running
        for axis in "xyz":
            column.prop(probe, f"resolution_{axis}", text=f"{iface_('Resolution')} X" if axis == "x" else axis.upper(),
                        translate=False)
        if context.object is not None and context.object.data == probe:
            layout.label(text=density(context.object), translate=False)
            layout.operator("rtgi.refit_volume", icon="CUBE")
        layout.prop(probe, "intensity")
        column = layout.column(heading="Capture")
        for name in ("capture_world", "capture_indirect", "capture_emission"):
            column.prop(probe, name)


class RTGI_PT_volume(Closed, _OfVolume, bpy.types.Panel):
    """What one Light Probe Volume does differently."""

    bl_label = "RTGI Overrides"
    bl_idname = "RTGI_PT_volume"

    def draw(self, context):
        """Which probes get rays, and every setting with a switch before it."""
        technique, own = registry()[context.scene.rtgi.technique], context.lightprobe.rtgi
        group = getattr(own, attribute(technique.name))
        column = split(self.layout).column()
        column.enabled = not session.running
        column.prop(own, "near_surfaces")
        if own.near_surfaces:
            for name in ("clearance", "outside", "outermost"):
                column.prop(own, name)
        for item in fields(technique.Settings):
            draw_setting(column, group, technique, item, toggle=f"override_{item.name}")


class RTGI_PT_bake(InSidebar, bpy.types.Panel):
    """The actions, and what is baked."""

    bl_label = "Light Probes"
    bl_idname = "RTGI_PT_bake"

    def draw(self, context):
        """Volumes, Bake or its progress."""
        width = context.region.width
        draw_slow_rays(self.layout, width)
        draw_volumes(self.layout, context, width)
        draw_actions(self.layout.column(), context)


class RTGI_PT_last_bake(InSidebar, bpy.types.Panel):
    """What is baked, how good it is, and whether it still holds."""

    bl_label = "Last Bake"
    bl_parent_id = "RTGI_PT_bake"

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
            (iface_("Error on Surfaces"), _surface_error(last)),
            (iface_("Noise at Probes"), f"{100 * last.error:.2g}%" if last.error >= 0 else iface_("unknown")),
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


def _surface_error(last) -> str:
    """The error on surfaces of the ``last`` bake with its interval."""
    if last.surface_error < 0:
        return iface_("unknown")
    value, low, high = (f"{100 * part:.2g}" for part in (last.surface_error, last.surface_low, last.surface_high))
    return f"{value}% ({low}–{high})"


class RTGI_PT_checks(InSidebar, bpy.types.Panel):
    """What would spoil a bake."""

    bl_label = "Checks"
    bl_parent_id = "RTGI_PT_bake"

    def draw(self, context):
        """Findings of the last reading; drawing reads nothing itself."""
        layout = self.layout
        findings = session.findings.get(context.scene.name)
        for finding in findings or ():
            draw_lines(layout, _sentence(sentence(finding.text)), context.region.width, _ICONS[finding.severity], finding)
        if findings is not None and not findings:
            layout.label(text="Nothing to report", icon="CHECKMARK")
        layout.operator("rtgi.check", icon="VIEWZOOM")


_CLASSES = (RTGI_PT_render, RTGI_PT_render_advanced, RTGI_PT_render_output, RTGI_PT_probe, RTGI_PT_volume, RTGI_PT_bake,
            RTGI_PT_last_bake, RTGI_PT_checks)
register, unregister = bpy.utils.register_classes_factory(_CLASSES)
