"""Options that several subcommands share: a technique and its settings."""

import argparse
from dataclasses import replace

from ... import effects, techniques
from ...effects import Chosen
from ...effects.atlas.settings import ATLAS, AtlasSettings
from ...effects.spheres.settings import SPHERES, SphereSettings
from ...errors import UsageError
from ...evaluate.plan import Target
from ...jobs.plan import USUAL
from ...jobs.settings import build_settings
from ...techniques.scattered.settings import PLACEMENTS, SCATTER, ScatterSettings
from ..styles import STYLES, STYLIZED, style_settings

# The technique that stands for whatever a plan chooses.
PLANNED = "auto"
# The largest whole number that Blender takes for anything.
MOST = (1 << 31) - 1
# What is baked beside the technique: settings of those have the owner's name before a point.
BESIDE = (SPHERES.name, ATLAS.name)
# Options that stand for a setting of the technique, under the setting's own name.
_SETTING_OPTIONS = ("order", "rays", "error", "bounces", "direct", "fit")


def add_technique(parser: argparse.ArgumentParser, planned: bool = False) -> None:
    """`--technique` and every option that sets it up, with `--seed`, `--threads` and `--volume`; ``planned`` allows PLANNED too."""
    names = ", ".join(techniques.names()) + (f", or {PLANNED}: the cheapest bake whose error at surfaces is within --error "
                                             f"(default {Target.error:g})" if planned else "")
    unnamed = f" (default {USUAL}; {PLANNED} where the file has no volume and no option here says how to bake)" if planned else ""
    parser.add_argument("--technique", default=None if planned else USUAL, metavar="NAME", help=f"one of {names}{unnamed}")
    parser.add_argument("--preset", choices=techniques.PRESETS, help="how exact, and how dear; other options go before it")
    parser.add_argument("--volume", action="append", metavar="NAME", help="bake only this volume; may be repeated")
    parser.add_argument("--order", type=int, metavar="L", help="order of the spherical harmonics")
    effort = parser.add_mutually_exclusive_group()
    effort.add_argument("--rays", type=int, metavar="N", help="a fixed number of rays per probe")
    effort.add_argument("--error", type=float, metavar="E", help="target relative error of the coefficients (default 0.01)")
    parser.add_argument("--bounces", type=int, metavar="N", help="how often light is reflected (default: until it has died away)")
    parser.add_argument("--direct", action="store_true", default=None, help="add the direct light of lamps to the probes")
    parser.add_argument("--fit", action=argparse.BooleanOptionalAction, default=None,
                        help="fit probes to how surfaces and moving things read them (default: as measured)")
    parser.add_argument("--seed", type=at_least(0), default=0, metavar="S", help="the same seed gives the same bytes")
    parser.add_argument("--threads", type=at_least(1), metavar="N", help="default: every core")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="assignments", type=_assignment,
                        help="any other setting of the technique, or spheres.NAME=VALUE of sphere probes and atlas.NAME=VALUE of "
                             "the light atlas; may be repeated")


def add_effects(parser: argparse.ArgumentParser) -> None:
    """`--effect`; `--set` then also takes settings of effects, with the effect's name before a point."""
    parser.add_argument("--effect", action="append", default=[], metavar="NAME", dest="effects",
                        help=f"apply this effect (one of {', '.join(effects.names())}); may be repeated; --set "
                             "NAME.SETTING=VALUE sets it up")
    on = [name for name, effect in effects.registry().items() if effect.on_by_default]
    parser.add_argument("--without-effect", action="append", default=[], metavar="NAME", dest="left_out", choices=on,
                        help=f"leave out an effect that is applied without being asked for ({', '.join(on)})")
    parser.add_argument("--style", metavar="NAME", help=f"apply the effect stylized as one of {', '.join(STYLES)}, or as a preset "
                                                        "of your own in Blender; --set stylized.SETTING=VALUE goes before it")


def chosen_effects(arguments: argparse.Namespace) -> tuple[Chosen, ...]:
    """The effects that the command line asks for, in the order in which they are applied. Raises UsageError."""
    contradicted = set(arguments.effects) & set(arguments.left_out)
    if contradicted:
        raise UsageError(f"--effect and --without-effect both name {min(contradicted)}", "leave one of them out")
    on = [name for name, effect in effects.registry().items() if effect.on_by_default and name not in arguments.left_out]
    given: dict[str, dict] = {name: {} for name in (*arguments.effects, *on)}
    if arguments.style is not None:
        given[STYLIZED] = dict(style_settings(arguments.style))
    for assignment, value in arguments.assignments:
        name, point, key = assignment.partition(".")
        if name in BESIDE:
            continue
        if point and name not in given:
            raise UsageError(f"--set {assignment} is for an effect that is not applied", f"add --effect {name}")
        if point:
            given[name][key] = value
    return effects.in_order(Chosen(effects.get(name), build_settings(effects.get(name), values, "effect"))
                            for name, values in given.items())


def sphere_settings(arguments: argparse.Namespace) -> SphereSettings:
    """How sphere probes are baked: `--set spheres.NAME=VALUE`. Raises UsageError."""
    return _settings_beside(arguments, SPHERES)


def atlas_settings(arguments: argparse.Namespace) -> AtlasSettings:
    """How the light atlas is baked: `--set atlas.NAME=VALUE`. Raises UsageError."""
    return _settings_beside(arguments, ATLAS)


def add_placement(parser: argparse.ArgumentParser) -> None:
    """`--placement`; `--set scatter.NAME=VALUE` then sets it up."""
    parser.add_argument("--placement", choices=PLACEMENTS,
                        help="where probes stand: on the lattices of volumes (default), or scattered above floors, where light "
                             "needs them; --set scatter.NAME=VALUE sets that up")


def scatter_settings(arguments: argparse.Namespace) -> ScatterSettings:
    """Where probes stand: `--placement` and `--set scatter.NAME=VALUE`. Raises UsageError."""
    settings = _settings_beside(arguments, SCATTER)
    if arguments.placement is not None:
        settings = replace(settings, placement=arguments.placement)
    if not settings.scatters and any(name.startswith(f"{SCATTER.name}.") for name, _ in arguments.assignments):
        raise UsageError(f"--set {SCATTER.name}.… is for scattered probes", "add --placement scattered")
    return settings


def is_beside(assignment: str, arguments: argparse.Namespace) -> bool:
    """Whether the setting of that name is one of what is baked beside probes, or of where those stand."""
    owners = (*BESIDE, SCATTER.name) if hasattr(arguments, "placement") else BESIDE
    return assignment.partition(".")[0] in owners and "." in assignment


def _settings_beside(arguments: argparse.Namespace, owner):
    return build_settings(owner, {name.partition(".")[2]: value for name, value in arguments.assignments
                                  if name.startswith(f"{owner.name}.")}, "bake of")


def overrides(arguments: argparse.Namespace) -> dict:
    """The settings of the technique that the command line names, by name."""
    given = {name: getattr(arguments, name) for name in _SETTING_OPTIONS if getattr(arguments, name) is not None}
    method = techniques.registry().get(arguments.technique or USUAL)
    preset = {} if method is None else method.presets.get(arguments.preset, {})
    # Where there are effects, what has a point in its name is theirs.
    own = {name: value for name, value in arguments.assignments
           if "." not in name or not (hasattr(arguments, "effects") or is_beside(name, arguments))}
    return {**preset, **own, **given}


def check_technique(arguments: argparse.Namespace) -> None:
    """Raise UsageError for settings that the technique does not have or allow; an unknown technique is found out later."""
    method = techniques.registry().get(arguments.technique)
    if method is not None:
        build_settings(method, overrides(arguments))


def at_least(low: int):
    """A type of argument: a whole number from ``low`` to MOST."""
    def number(text: str) -> int:
        value = int(text)
        if value < low:
            raise argparse.ArgumentTypeError(f"{text} is less than {low}")
        if value > MOST:
            raise argparse.ArgumentTypeError(f"{text} is more than {MOST}")
        return value

    return number


def above_zero(text: str) -> float:
    """A type of argument: a number above 0."""
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def _assignment(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name.strip(), value.strip()
