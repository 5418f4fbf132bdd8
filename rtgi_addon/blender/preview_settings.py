"""What the user sets for the preview: ``Scene.rtgi_preview``, made from ``PreviewSettings``, and ``ViewLayer.rtgi`` for passes."""

from dataclasses import fields, replace
from types import SimpleNamespace

import bpy

from ..preview.settings import OverlaySettings, PreviewSettings
from ..techniques import registry
from .properties import blender_property, read_value
from .session import redraw

# Blender has its own switch for it.
_ELSEWHERE = {"film_transparent"}
_SETTINGS = SimpleNamespace(name="preview", Settings=PreviewSettings)
_OVERLAYS = SimpleNamespace(name="overlays", Settings=OverlaySettings)

SHOWN = tuple(item for item in fields(PreviewSettings) if item.name not in _ELSEWHERE)


def _scene_group() -> type:
    annotations = {item.name: blender_property(_SETTINGS, item) for item in SHOWN}
    samples = next(item for item in SHOWN if item.name == "samples")
    annotations["render_samples"] = bpy.props.IntProperty(
        name="Render", description="Frames that are averaged for a render", default=int(samples.default), min=1,
        max=int(samples.metadata["maximum"]))
    annotations.update({item.name: blender_property(_OVERLAYS, item) for item in fields(OverlaySettings)})
    annotations["overlays_in_renders"] = bpy.props.BoolProperty(
        name="In Renders", description="Draw the overlays over the combined pass of renders as well")
    annotations["compare"] = bpy.props.BoolProperty(
        name="Compare", description="Show another technique right of a line through the viewport", update=_redraw)
    techniques = registry()
    annotations["compare_technique"] = bpy.props.EnumProperty(
        name="Other Technique", description="What is shown right of the line", update=_redraw,
        items=[(name, technique.label, technique.description.rstrip(".")) for name, technique in techniques.items()])
    annotations["split"] = bpy.props.FloatProperty(
        name="Split", description="Where the line is, from the left edge of the viewport to the right", default=0.5, min=0.0,
        max=1.0, subtype="FACTOR", update=_redraw)
    return type("RTGI_PG_preview", (bpy.types.PropertyGroup,), {"__annotations__": annotations})


def _redraw(_self, _context) -> None:
    redraw()


class RTGI_PG_view_layer(bpy.types.PropertyGroup):
    """Passes that Blender's own view layers have no switch for."""

    use_direct: bpy.props.BoolProperty(name="Direct", description="Deliver the light of lamps and what surfaces emit")
    use_indirect: bpy.props.BoolProperty(name="Indirect", description="Deliver the indirect light that surfaces reflect")
    use_irradiance: bpy.props.BoolProperty(
        name="Irradiance", description="Deliver the indirect light that arrives at surfaces (in W/m²)")


def preview_settings(scene: bpy.types.Scene, *, final: bool) -> PreviewSettings:
    """The settings of ``scene`` for the viewport, or for a ``final`` picture: whole resolution, everything combined."""
    group = scene.rtgi_preview
    settings = PreviewSettings(**{item.name: read_value(_SETTINGS, group, item.name) for item in SHOWN},
                               film_transparent=scene.render.film_transparent)
    if not final:
        return settings
    return replace(settings, samples=group.render_samples, resolution_scale=1.0, mode="combined")


def overlay_settings(scene: bpy.types.Scene) -> OverlaySettings:
    """What ``scene`` asks to be drawn over its pictures."""
    group = scene.rtgi_preview
    return OverlaySettings(**{item.name: read_value(_OVERLAYS, group, item.name) for item in fields(OverlaySettings)})


def register() -> None:
    """Put the properties on scenes and view layers."""
    global _group
    _group = _scene_group()
    bpy.utils.register_class(_group)
    bpy.utils.register_class(RTGI_PG_view_layer)
    bpy.types.Scene.rtgi_preview = bpy.props.PointerProperty(
        type=_group, name="RTGI Preview", description="What the preview shows, and how much work a frame may be")
    bpy.types.ViewLayer.rtgi = bpy.props.PointerProperty(
        type=RTGI_PG_view_layer, name="RTGI Passes", description="Passes of a render with the engine RTGI")


def unregister() -> None:
    """Take them out."""
    del bpy.types.ViewLayer.rtgi
    del bpy.types.Scene.rtgi_preview
    bpy.utils.unregister_class(RTGI_PG_view_layer)
    bpy.utils.unregister_class(_group)


_group: type
