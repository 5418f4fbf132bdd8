"""What the user sets: properties generated from every technique's ``Settings``, on the scene and as overrides on a volume.

``Scene.rtgi`` holds the technique, where the bake goes, one group of settings per technique and what the last bake was;
``LightProbe.rtgi`` holds, per technique, the same settings with a toggle each: those switched on take the scene's place.
"""

import types
import typing
from collections.abc import Callable
from dataclasses import fields

import bpy
import numpy as np

from ..techniques import Technique, registry, validate_settings

# Two ways to say how long to trace. A technique whose Settings have both gets a switch between them; it goes by the rays unless
# they are None.
GOALS = ("error", "rays")
_UNITS = {"m": {"subtype": "DISTANCE"}, "rad": {"subtype": "ANGLE"}, "%": {"subtype": "PERCENTAGE"}}


# Called without arguments whenever a setting of a scene or a volume has changed.
on_change: list[Callable[[], None]] = []


def _changed(_group, _context) -> None:
    for listener in on_change:
        listener()


def attribute(technique_name: str) -> str:
    """The property of ``Scene.rtgi`` and ``LightProbe.rtgi`` that holds a technique's settings."""
    return "technique_" + "".join(letter if letter.isalnum() else "_" for letter in technique_name)


def value_type(technique: Technique, name: str) -> tuple[type, bool]:
    """The plain type of a setting (bool, int, float or str), and whether None is a value of it as well."""
    annotation = typing.get_type_hints(technique.Settings)[name]
    options = typing.get_args(annotation) if isinstance(annotation, types.UnionType) or typing.get_origin(annotation) else ()
    plain = [option for option in options if option is not type(None)] or [annotation]
    return plain[0], type(None) in options


def tooltip(item, translate: Callable[[str], str] = str) -> str:
    """The description of a ``Settings`` field with its unit and range, as Blender writes tooltips: without a full stop.
    ``translate`` is given what it is made of."""
    meta = item.metadata
    text = translate(meta["description"].rstrip("."))
    low, high, unit = meta.get("minimum"), meta.get("maximum"), meta.get("unit")
    unit = f" {unit}" if unit else ""
    if meta.get("choices"):
        return text
    if low is not None and high is not None:
        return f"{text} ({translate('{0} to {1}').format(_plain(low), _plain(high))}{unit})"
    if low is not None:
        return f"{text} ({translate('at least {0}').format(_plain(low))}{unit})"
    return f"{text} ({translate('in {0}').format(unit.strip())})" if unit else text


def override_texts(label: str, translate: Callable[[str], str] = str) -> tuple[str, str]:
    """Label and tooltip of the switch that lets a volume override a setting called ``label``."""
    return tuple(translate(text).format(translate(label)) for text in (
        "Override {0}", "Use another value of {0} for this volume than the scene's"))


def use_text(label: str, translate: Callable[[str], str] = str) -> str:
    """Label of the switch before a setting called ``label`` that may be left to the technique."""
    return translate("Use {0}").format(translate(label))


def choice_label(choice) -> str:
    """What a choice of a setting is called."""
    return str(choice).replace("_", " ").capitalize()


def _plain(number: float) -> str:
    """A bound as a person writes it: no exponents."""
    return f"{number:,.6f}".rstrip("0").rstrip(".")


def blender_property(technique: Technique, item):
    """The bpy property for one field of a ``Settings`` dataclass, with its label, tooltip, range, unit and default."""
    kind, _ = value_type(technique, item.name)
    meta = item.metadata
    common = {"name": meta["label"], "description": tooltip(item), "update": _changed}
    if meta.get("choices"):
        items = [(str(choice), choice_label(choice), common["description"]) for choice in meta["choices"]]
        default = meta["choices"][0] if item.default is None else item.default
        return bpy.props.EnumProperty(items=items, default=str(default), **common)
    if kind is bool:
        return bpy.props.BoolProperty(default=bool(item.default), **common)
    if kind is str:
        return bpy.props.StringProperty(default=item.default or "", **common)
    limits = {name: meta[key] for name, key in (("min", "minimum"), ("max", "maximum")) if meta.get(key) is not None}
    default = _middle(**limits) if item.default is None else item.default
    if kind is int:
        return bpy.props.IntProperty(default=int(default), **{name: int(limit) for name, limit in limits.items()}, **common)
    small = 0 < abs(default) < 0.1 or 0 < abs(limits.get("min", 0)) < 0.1
    return bpy.props.FloatProperty(default=default, precision=4 if small else 3, step=0.1 if small else 3, **limits, **common,
                                   **_UNITS.get(meta.get("unit"), {}))


def _middle(min: float = 0.0, max: float = 1.0) -> float:
    """Where a number starts that is unset by default: the geometric middle of its range, counted from 1 if that begins at 0, to
    one digit."""
    return float(f"{np.sqrt((min if min > 0 else 1.0) * max):.0e}")


def settings_group(technique: Technique, overrides: bool) -> type:
    """A PropertyGroup with one property per setting; with ``override_…`` toggles, or ``use_…`` for settings that may be None."""
    annotations = {}
    for item in fields(technique.Settings):
        label = item.metadata["label"]
        if overrides:
            name, description = override_texts(label)
            annotations[f"override_{item.name}"] = bpy.props.BoolProperty(name=name, description=description, update=_changed)
        if value_type(technique, item.name)[1] and item.name not in GOALS:
            annotations[f"use_{item.name}"] = bpy.props.BoolProperty(
                name=use_text(label), description=tooltip(item), default=item.default is not None, update=_changed)
        annotations[item.name] = blender_property(technique, item)
    suffix = attribute(technique.name) + ("_overrides" if overrides else "")
    return type(f"RTGI_PG_{suffix}", (bpy.types.PropertyGroup,), {"__annotations__": annotations})


def has_goal(technique: Technique) -> bool:
    """True if the technique can stop at an error or at a number of rays, so that the user chooses which."""
    names = {item.name for item in fields(technique.Settings)}
    return names.issuperset(GOALS)


def read_value(technique: Technique, group, name: str):
    """One setting from a property group, in the type the ``Settings`` dataclass wants."""
    kind, optional = value_type(technique, name)
    if optional and name not in GOALS and not getattr(group, f"use_{name}"):
        return None
    value = getattr(group, name)
    if kind is float:  # Blender keeps single precision: 0.01 comes back as 0.00999999978
        return float(np.format_float_positional(np.float32(value), unique=True))
    return kind(value)


def scene_settings(scene: bpy.types.Scene, technique_name: str | None = None):
    """(technique, its Settings) as the panel says, of the technique that is chosen or of the one of that name. Raises UsageError
    for a value out of range."""
    technique = registry()[technique_name or scene.rtgi.technique]
    group = getattr(scene.rtgi, attribute(technique.name))
    values = {item.name: read_value(technique, group, item.name) for item in fields(technique.Settings)}
    if has_goal(technique) and scene.rtgi.mode == "ERROR":
        values["rays"] = None
    settings = technique.Settings(**values)
    validate_settings(settings)
    return technique, settings


def overrides(group, technique_name: str | None = None) -> dict:
    """The overrides switched on in ``LightProbe.rtgi`` (name → value) for a technique, or for the one the current scene uses:
    ``ProbeVolume.settings``."""
    technique = registry()[technique_name or bpy.context.scene.rtgi.technique]
    values = getattr(group, attribute(technique.name))
    return {item.name: read_value(technique, values, item.name) for item in fields(technique.Settings)
            if getattr(values, f"override_{item.name}")}


def use_preset(group, name: str) -> None:
    """Set every technique of ``Scene.rtgi`` to its preset ``name``; what a preset does not name stays as it is."""
    for technique in registry().values():
        values = getattr(group, attribute(technique.name))
        for setting_name, value in technique.presets.get(name, {}).items():
            if setting_name in GOALS:
                if has_goal(technique):
                    group.mode = setting_name.upper()
            elif value_type(technique, setting_name)[1]:
                setattr(values, f"use_{setting_name}", value is not None)
            if value is not None:
                setattr(values, setting_name, value)


class RTGI_PG_last_bake(bpy.types.PropertyGroup):
    """What the last bake of a scene was, as the panel shows it; ``folder`` is empty if there was none."""

    folder: bpy.props.StringProperty(name="Folder", description="Where the last bake lies", subtype="DIR_PATH")
    technique: bpy.props.StringProperty(name="Technique", description="The technique that made the last bake")
    probes: bpy.props.IntProperty(name="Probes", description="How many probes the last bake has, over all volumes")
    usable: bpy.props.FloatProperty(
        name="Usable", description="Share of probes that lie in the open; the others take their light from neighbours",
        min=0.0, max=1.0)
    error: bpy.props.FloatProperty(
        name="Estimated Error", min=-1.0, precision=4, default=-1.0,
        description="Estimated relative error of the spherical harmonics against infinitely many rays; negative if unknown")
    seconds: bpy.props.FloatProperty(name="Seconds", description="How long the last bake took", min=0.0)
    fingerprint: bpy.props.StringProperty(
        name="Fingerprint", description="What the scene looked like when it was baked", options={"HIDDEN"})


def _scene_group(techniques: dict[str, Technique], groups: dict[str, type]) -> type:
    annotations = {
        "technique": bpy.props.EnumProperty(
            name="Technique", description="How indirect light is computed", update=_changed,
            items=[(name, technique.label, technique.description.rstrip(".")) for name, technique in techniques.items()],
            default="probes" if "probes" in techniques else next(iter(techniques))),
        "output": bpy.props.StringProperty(
            name="Output", default="//rtgi_bake/", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
            description="Folder the bake is written to. An earlier bake in it is replaced once the new one is whole"),
        "seed": bpy.props.IntProperty(
            name="Seed", description="Start of the random numbers. The same seed gives the same bytes", default=0, min=0,
            update=_changed),
        "device": bpy.props.EnumProperty(
            name="Device", description="Where the inner loops of the bake run", default="CPU", update=_changed,
            items=[("CPU", "CPU", "Every core of the processor"),
                   ("GPU", "GPU", "The graphics card that Blender draws with; the window waits for it")]),
        "mode": bpy.props.EnumProperty(
            name="Stop At", description="What ends the tracing of a probe", default="ERROR", update=_changed,
            items=[("ERROR", "Error", "Trace each probe until its estimated error is small enough"),
                   ("RAYS", "Rays", "Trace the same number of rays for every probe")]),
        "last_bake": bpy.props.PointerProperty(
            type=RTGI_PG_last_bake, name="Last Bake", description="What the last bake of this scene was"),
    }
    for name, group in groups.items():
        annotations[attribute(name)] = _pointer(techniques[name], group)
    return type("RTGI_PG_scene", (bpy.types.PropertyGroup,), {"__annotations__": annotations, "use_preset": use_preset})


def _pointer(technique: Technique, group: type):
    return bpy.props.PointerProperty(type=group, name=technique.label, description=f"Settings of the technique {technique.label}")


def _volume_group(techniques: dict[str, Technique], groups: dict[str, type]) -> type:
    annotations = {attribute(name): _pointer(techniques[name], group) for name, group in groups.items()}
    return type("RTGI_PG_volume", (bpy.types.PropertyGroup,), {"__annotations__": annotations, "overrides": overrides})


_registered: list[type] = []


def register() -> None:
    """Generate the property groups of all techniques and put them on scenes and light probes."""
    techniques = registry()
    scene_groups = {name: settings_group(technique, overrides=False) for name, technique in techniques.items()}
    volume_groups = {name: settings_group(technique, overrides=True) for name, technique in techniques.items()}
    scene_group, volume_group = _scene_group(techniques, scene_groups), _volume_group(techniques, volume_groups)
    for group in (RTGI_PG_last_bake, *scene_groups.values(), *volume_groups.values(), scene_group, volume_group):
        bpy.utils.register_class(group)
        _registered.append(group)
    bpy.types.Scene.rtgi = bpy.props.PointerProperty(type=scene_group, name="RTGI", description="Real-time global illumination")
    bpy.types.LightProbe.rtgi = bpy.props.PointerProperty(
        type=volume_group, name="RTGI", description="What this volume does differently from the scene's settings")


def unregister() -> None:
    """Take the properties out; what files hold of them stays in the files."""
    for owner in (bpy.types.LightProbe, bpy.types.Scene):
        if hasattr(owner, "rtgi"):
            del owner.rtgi
    while _registered:
        bpy.utils.unregister_class(_registered.pop())
