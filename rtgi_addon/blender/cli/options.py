"""Options that several subcommands share: a technique and its settings."""

import argparse

from ... import techniques
from ...evaluate.plan import Target
from ...jobs.settings import build_settings

# The technique that stands for whatever a plan chooses.
PLANNED = "auto"
# Options that stand for a setting of the technique, under the setting's own name.
_SETTING_OPTIONS = ("order", "rays", "error", "bounces", "direct")


def add_technique(parser: argparse.ArgumentParser, planned: bool = False) -> None:
    """`--technique` and every option that sets it up, with `--seed`, `--threads` and `--volume`; ``planned`` allows PLANNED too."""
    names = ", ".join(techniques.names()) + (f", or {PLANNED}: the cheapest bake whose error at surfaces is within --error "
                                             f"(default {Target.error:g})" if planned else "")
    parser.add_argument("--technique", default="probes", metavar="NAME", help=f"one of {names}")
    parser.add_argument("--preset", choices=techniques.PRESETS, help="how exact, and how dear; other options go before it")
    parser.add_argument("--volume", action="append", metavar="NAME", help="bake only this volume; may be repeated")
    parser.add_argument("--order", type=int, metavar="L", help="order of the spherical harmonics")
    effort = parser.add_mutually_exclusive_group()
    effort.add_argument("--rays", type=int, metavar="N", help="a fixed number of rays per probe")
    effort.add_argument("--error", type=float, metavar="E", help="target relative error of the coefficients (default 0.01)")
    parser.add_argument("--bounces", type=int, metavar="N", help="how often light is reflected (default: until it has died away)")
    parser.add_argument("--direct", action="store_true", default=None, help="add the direct light of lamps to the probes")
    parser.add_argument("--seed", type=at_least(0), default=0, metavar="S", help="the same seed gives the same bytes")
    parser.add_argument("--threads", type=at_least(1), metavar="N", help="default: every core")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="assignments", type=_assignment,
                        help="any other setting of the technique; may be repeated")


def overrides(arguments: argparse.Namespace) -> dict:
    """The settings that the command line names, by name."""
    given = {name: getattr(arguments, name) for name in _SETTING_OPTIONS if getattr(arguments, name) is not None}
    method = techniques.registry().get(arguments.technique)
    preset = {} if method is None else method.presets.get(arguments.preset, {})
    return {**preset, **dict(arguments.assignments), **given}


def check_technique(arguments: argparse.Namespace) -> None:
    """Raise UsageError for settings that the technique does not have or allow; an unknown technique is found out later."""
    method = techniques.registry().get(arguments.technique)
    if method is not None:
        build_settings(method, overrides(arguments))


def at_least(low: int):
    """A type of argument: a whole number from ``low``."""
    def number(text: str) -> int:
        value = int(text)
        if value < low:
            raise argparse.ArgumentTypeError(f"{text} is less than {low}")
        return value

    return number


def _assignment(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name.strip(), value.strip()
