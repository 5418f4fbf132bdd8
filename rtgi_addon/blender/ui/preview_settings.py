"""What the user sets for the preview: ``Scene.rtgi_preview``, made from ``PreviewSettings``, and ``ViewLayer.rtgi`` for passes."""

from dataclasses import fields, replace
from types import SimpleNamespace

import bpy

from ...effects.gathering import ERROR, GATHERS, MOST_SAMPLES
from ...preview.settings import OverlaySettings, PreviewSettings
from ...techniques import registry
from ...techniques.probes.live import LiveSettings
from ..session import redraw
from .properties import blender_property, read_value, scene_settings

# Blender has its own switch for it.
_ELSEWHERE = {"film_transparent"}
_SETTINGS = SimpleNamespace(name="preview", Settings=PreviewSettings)
_OVERLAYS = SimpleNamespace(name="overlays", Settings=OverlaySettings)
_LIVE = SimpleNamespace(name="live", Settings=LiveSettings)

SHOWN = tuple(item for item in fields(PreviewSettings) if item.name not in _ELSEWHERE)
# Those of the bake are the technique's own.
LIVE_SHOWN = tuple(item for item in fields(LiveSettings) if item.metadata)


def _scene_group() -> type:
    annotations = {item.name: blender_property(_SETTINGS, item) for item in SHOWN}
    samples = next(item for item in SHOWN if item.name == "samples")
    annotations["render_samples"] = bpy.props.IntProperty(
        name="Render", description="Frames that are averaged for a render", default=int(samples.default), min=1,
        max=int(samples.metadata["maximum"]))
    annotations["gather"] = bpy.props.EnumProperty(
        name="Gather", description="Where the indirect light of renders comes from",
        items=[(GATHERS[0], "Bake", "What was baked, as in the viewport"),
               (GATHERS[1], "Rays", "Rays of every pixel, without a bake: exact, on the CPU")])
    annotations["gather_error"] = bpy.props.FloatProperty(
        name="Picture Error", default=ERROR, min=0.001, max=0.5, precision=3,
        description="How far the picture may be off by its noise: samples end where all of it is nearer, as a root mean square "
                    "relative to its mean")
    annotations["gather_samples"] = bpy.props.IntProperty(
        name="Most Samples", description="No pixel of a render by rays has more samples than this", default=MOST_SAMPLES, min=8,
        max=65536)
    annotations.update({item.name: blender_property(_OVERLAYS, item) for item in fields(OverlaySettings)})
    annotations["live_probes"] = bpy.props.BoolProperty(
        name="Live Probes", description="Trace probes anew all the time, so that they follow what moves, instead of showing a bake",
        update=_redraw)
    annotations.update({live_property(item): blender_property(_LIVE, item) for item in LIVE_SHOWN})
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


def live_property(item) -> str:
    """The property of ``Scene.rtgi_preview`` that holds a field of LiveSettings."""
    return f"live_{item.name}"


def _redraw(_self, _context) -> None:
    redraw()


class RTGI_PG_view_layer(bpy.types.PropertyGroup):
    """Passes that Blender's own view layers have no switch for."""

    use_direct: bpy.props.BoolProperty(name="Direct", description="Deliver the light of lamps and what surfaces emit")
    use_indirect: bpy.props.BoolProperty(name="Indirect", description="Deliver the indirect light that surfaces reflect")
    use_irradiance: bpy.props.BoolProperty(
        name="Irradiance", description="Deliver the indirect light that arrives at surfaces (in W/m²)")
    use_volume_direct: bpy.props.BoolProperty(
        name="Volume Direct", description="Deliver the light of lamps that media scatter once, and what media give of their own")
    use_volume_indirect: bpy.props.BoolProperty(
        name="Volume Indirect", description="Deliver the light that media scatter after it was scattered or reflected before")
    use_mirror_confidence: bpy.props.BoolProperty(
        name="Mirror Confidence", description="Deliver how far screen-space reflections are believed, 0 where the bake stands in")
    use_mirror_distance: bpy.props.BoolProperty(
        name="Mirror Distance", description="Deliver how far away what screen-space reflections show is (in m), 0 for nothing")
    use_transmittance: bpy.props.BoolProperty(
        name="Transmittance", description="Deliver the share of light that media leave between surfaces and the eye")


def preview_settings(scene: bpy.types.Scene, *, final: bool) -> PreviewSettings:
    """The settings of ``scene`` for the viewport, or for a ``final`` picture: whole resolution, everything combined."""
    group = scene.rtgi_preview
    settings = PreviewSettings(**{item.name: read_value(_SETTINGS, group, item.name) for item in SHOWN},
                               film_transparent=scene.render.film_transparent)
    if not final:
        return settings
    return replace(settings, samples=group.render_samples, resolution_scale=1.0, mode="combined")


def live_settings(scene: bpy.types.Scene) -> LiveSettings:
    """How ``scene`` keeps live probes up to date, which stand for a bake as it would be. Raises UsageError for a value out of
    range."""
    group = SimpleNamespace(**{item.name: getattr(scene.rtgi_preview, live_property(item)) for item in LIVE_SHOWN})
    return LiveSettings(**{item.name: read_value(_LIVE, group, item.name) for item in LIVE_SHOWN},
                        probes=scene_settings(scene, "probes")[1])


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
