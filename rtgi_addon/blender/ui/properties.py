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

from ...effects.atlas.settings import ATLAS, AtlasSettings
from ...effects.spheres.settings import SPHERES, SphereSettings
from ...techniques import Technique, registry, validate_settings
from ...techniques.scattered.settings import SCATTER, ScatterSettings

# Two ways to say how long to trace. A technique whose Settings have both gets a switch between them; it goes by the rays unless
# they are None.
GOALS = ("error", "rays")
# What a setting is set to that names an object in place of a word.
OBJECT = "OBJECT"
_UNITS = {"m": {"subtype": "DISTANCE"}, "rad": {"subtype": "ANGLE"}, "%": {"subtype": "PERCENTAGE"}}
# A setting whose default or lower limit is below this is shown with a digit more, and a drag changes it by less.
_SMALL = 0.1
_FINE, _COARSE = {"precision": 4, "step": 0.1}, {"precision": 3, "step": 3}


# Called without arguments whenever a setting of a scene, a volume, an object or a lamp has changed.
on_change: list[Callable[[], None]] = []


def notify(_group, _context) -> None:
    """Tell whoever listens that a property has changed: what bpy calls as its ``update``."""
    for listener in on_change:
        listener()


def attribute(name: str, kind: str = "technique") -> str:
    """The property of ``Scene.rtgi`` and ``LightProbe.rtgi`` that holds a technique's settings; with ``kind`` "effect" that of
    ``Scene.rtgi_effects`` that holds an effect's."""
    return f"{kind}_" + "".join(letter if letter.isalnum() else "_" for letter in name)


def value_type(technique: Technique, name: str) -> tuple[type, bool]:
    """The plain type of a setting (bool, int, float, str, or tuple for a colour), and whether None is a value of it as well."""
    annotation = typing.get_type_hints(technique.Settings)[name]
    if typing.get_origin(annotation) is tuple:
        return tuple, False
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
    common = {"name": meta["label"], "description": tooltip(item), "update": notify}
    if meta.get("choices"):
        items = [(str(choice), choice_label(choice), common["description"]) for choice in meta["choices"]]
        default = meta["choices"][0] if item.default is None else item.default
        return bpy.props.EnumProperty(items=items, default=str(default), **common)
    if kind is bool:
        return bpy.props.BoolProperty(default=bool(item.default), **common)
    if kind is str:
        return bpy.props.StringProperty(default=item.default or "", **common)
    limits = {name: meta[key] for name, key in (("min", "minimum"), ("max", "maximum")) if meta.get(key) is not None}
    if kind is tuple:
        return bpy.props.FloatVectorProperty(default=item.default, size=len(item.default), subtype="COLOR", **limits, **common)
    default = _middle(**limits) if item.default is None else item.default
    if kind is int:
        return bpy.props.IntProperty(default=int(default), **{name: int(limit) for name, limit in limits.items()}, **common)
    small = any(0 < abs(value) < _SMALL for value in (default, limits.get("min", 0)))
    return bpy.props.FloatProperty(default=default, **(_FINE if small else _COARSE), **limits, **common,
                                   **_UNITS.get(meta.get("unit"), {}))


def _middle(min: float = 0.0, max: float = 1.0) -> float:
    """Where a number starts that is unset by default: the geometric middle of its range, counted from 1 if that begins at 0, to
    one digit."""
    return float(f"{np.sqrt((min if min > 0 else 1.0) * max):.0e}")


def settings_group(technique: Technique, overrides: bool, kind: str = "technique") -> type:
    """A PropertyGroup with one property per setting; with ``override_…`` toggles, or ``use_…`` for settings that may be None."""
    annotations = {}
    for item in fields(technique.Settings):
        label = item.metadata["label"]
        if overrides:
            name, description = override_texts(label)
            annotations[f"override_{item.name}"] = bpy.props.BoolProperty(name=name, description=description, update=notify)
        if value_type(technique, item.name)[1] and item.name not in GOALS:
            annotations[f"use_{item.name}"] = bpy.props.BoolProperty(
                name=use_text(label), description=tooltip(item), default=item.default is not None, update=notify)
        annotations[item.name] = blender_property(technique, item)
        if item.metadata.get("or_object"):
            annotations[place_of(item)] = _place(item)
    suffix = attribute(technique.name, kind) + ("_overrides" if overrides else "")
    return type(f"RTGI_PG_{suffix}", (bpy.types.PropertyGroup,), {"__annotations__": annotations})


def place_of(item) -> str:
    """The property to show for a field of a ``Settings``: its own, or the choice between words and an object where it may name
    one."""
    return f"{item.name}_is" if item.metadata.get("or_object") else item.name


def _place(item):
    """A choice that is written to the string property of ``item``: one of its words, or OBJECT with the name of one."""
    words = item.metadata["or_object"]

    def get(group) -> int:
        value = getattr(group, item.name)
        return words.index(value) if value in words else len(words)

    def set(group, number: int) -> None:
        if number < len(words):
            setattr(group, item.name, words[number])
        elif getattr(group, item.name) in words:
            active = bpy.context.object or next(iter(bpy.data.objects), None)
            setattr(group, item.name, "" if active is None else active.name)

    description = tooltip(item)
    items = [(word, choice_label(word), description, number) for number, word in enumerate(words)]
    return bpy.props.EnumProperty(name=item.metadata["label"], description=description, get=get, set=set,
                                  items=[*items, (OBJECT, "Object", description, len(words))])


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
    if kind is tuple:
        return tuple(_as_typed(number) for number in value)
    return _as_typed(value) if kind is float else kind(value)


def _as_typed(value: float) -> float:
    # Blender keeps single precision: 0.01 comes back as 0.00999999978.
    return float(np.format_float_positional(np.float32(value), unique=True))


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


def sphere_settings(scene: bpy.types.Scene) -> SphereSettings:
    """How sphere probes of ``scene`` are baked, as the panel says. Raises UsageError for a value out of range."""
    return _settings_beside(SPHERES, scene.rtgi.spheres)


def atlas_settings(scene: bpy.types.Scene) -> AtlasSettings:
    """How the light atlas of ``scene`` is baked, as the panel says. Raises UsageError for a value out of range."""
    return _settings_beside(ATLAS, scene.rtgi.atlas)


def scatter_settings(scene: bpy.types.Scene) -> ScatterSettings:
    """Where probes of ``scene`` stand, as the panel says. Raises UsageError for a value out of range."""
    return _settings_beside(SCATTER, scene.rtgi.scatter)


def _settings_beside(owner, group):
    settings = owner.Settings(**{item.name: read_value(owner, group, item.name) for item in fields(owner.Settings)})
    validate_settings(settings)
    return settings


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
        name="Noise at Probes", min=-1.0, precision=4, default=-1.0,
        description="Estimated relative error of what probes measured against infinitely many rays; negative if unknown")
    surface_error: bpy.props.FloatProperty(
        name="Error on Surfaces", min=-1.0, precision=4, default=-1.0,
        description="Relative error of the light that surfaces read from probes, at a few points; negative if unknown")
    surface_low: bpy.props.FloatProperty(
        name="Error on Surfaces at Least", min=-1.0, precision=4, default=-1.0,
        description="Lower end of the 95% interval of the error on surfaces; negative if unknown")
    surface_high: bpy.props.FloatProperty(
        name="Error on Surfaces at Most", min=-1.0, precision=4, default=-1.0,
        description="Upper end of the 95% interval of the error on surfaces; negative if unknown")
    seconds: bpy.props.FloatProperty(name="Seconds", description="How long the last bake took", min=0.0)
    fingerprint: bpy.props.StringProperty(
        name="Fingerprint", description="What the scene looked like when it was baked", options={"HIDDEN"})


def _scene_group(techniques: dict[str, Technique], groups: dict[str, type], spheres: type, atlas: type,
                 scatter: type) -> type:
    annotations = {
        "technique": bpy.props.EnumProperty(
            name="Technique", description="How indirect light is computed", update=notify,
            items=[(name, technique.label, technique.description.rstrip(".")) for name, technique in techniques.items()],
            default="probes" if "probes" in techniques else next(iter(techniques))),
        "output": bpy.props.StringProperty(
            name="Output", default="//rtgi_bake/", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
            description="Folder the bake is written to. An earlier bake in it is replaced once the new one is whole"),
        "seed": bpy.props.IntProperty(
            name="Seed", description="Start of the random numbers. The same seed gives the same bytes", default=0, min=0,
            update=notify),
        "device": bpy.props.EnumProperty(
            name="Device", description="Where the inner loops of the bake run", default="CPU", update=notify,
            items=[("CPU", "CPU", "Every core of the processor"),
                   ("GPU", "GPU", "The graphics card that Blender draws with; the window waits for it")]),
        "mode": bpy.props.EnumProperty(
            name="Stop At", description="What ends the tracing of a probe", default="ERROR", update=notify,
            items=[("ERROR", "Error", "Trace each probe until its estimated error is small enough"),
                   ("RAYS", "Rays", "Trace the same number of rays for every probe")]),
        "last_bake": bpy.props.PointerProperty(
            type=RTGI_PG_last_bake, name="Last Bake", description="What the last bake of this scene was"),
    }
    for name, group in groups.items():
        annotations[attribute(name)] = _pointer(techniques[name], group)
    annotations["spheres"] = bpy.props.PointerProperty(type=spheres, name=SPHERES.label, description="How sphere probes are baked")
    annotations["atlas"] = bpy.props.PointerProperty(type=atlas, name=ATLAS.label, description="How the light atlas is baked")
    annotations["scatter"] = bpy.props.PointerProperty(type=scatter, name=SCATTER.label, description="Where probes stand")
    return type("RTGI_PG_scene", (bpy.types.PropertyGroup,), {"__annotations__": annotations, "use_preset": use_preset})


def _pointer(technique: Technique, group: type):
    return bpy.props.PointerProperty(type=group, name=technique.label, description=f"Settings of the technique {technique.label}")


def _volume_group(techniques: dict[str, Technique], groups: dict[str, type]) -> type:
    annotations = {
        "near_surfaces": bpy.props.BoolProperty(
            name="Only Near Surfaces", update=notify,
            description="Trace no rays from probes that no surface reads. Things that move far from surfaces are then lit by what "
                        "those near them have"),
        "clearance": bpy.props.FloatProperty(
            name="Clearance", description="How far off a surface things may stand and still be lit by probes of their own",
            default=0.0, min=0.0, subtype="DISTANCE", update=notify),
        "outside": bpy.props.FloatProperty(
            name="Outside", description="Surfaces up to so far outside the volume count as well",
            default=0.0, min=0.0, subtype="DISTANCE", update=notify),
        "outermost": bpy.props.BoolProperty(
            name="Keep Outermost", description="Keep the outermost layer of probes, for surfaces anywhere outside the volume",
            default=True, update=notify),
        "planned": bpy.props.StringProperty(
            name="Planned In", description="The volume that a plan placed this one in; the next plan places its own instead",
            options={"HIDDEN"}),
    }
    annotations |= {attribute(name): _pointer(techniques[name], group) for name, group in groups.items()}
    return type("RTGI_PG_volume", (bpy.types.PropertyGroup,), {"__annotations__": annotations, "overrides": overrides})


_registered: list[type] = []


def register() -> None:
    """Generate the property groups of all techniques and put them on scenes and light probes."""
    techniques = registry()
    scene_groups = {name: settings_group(technique, overrides=False) for name, technique in techniques.items()}
    volume_groups = {name: settings_group(technique, overrides=True) for name, technique in techniques.items()}
    beside = [settings_group(owner, overrides=False, kind="bake") for owner in (SPHERES, ATLAS, SCATTER)]
    scene_group, volume_group = _scene_group(techniques, scene_groups, *beside), _volume_group(techniques, volume_groups)
    for group in (RTGI_PG_last_bake, *scene_groups.values(), *volume_groups.values(), *beside, scene_group, volume_group):
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
