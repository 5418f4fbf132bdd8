"""`bake`: every Light Probe Volume of the file into a bundle."""

import argparse

from ... import techniques
from ...exchange.bundle import check_target
from ...jobs.bake import bake_scene, require_device
from ...jobs.report import BakeSummary
from ...jobs.settings import build_settings
from .base import EXTRACT_SHARE, Session, Subcommand

# Options that stand for a setting of the technique, under the setting's own name.
_SETTING_OPTIONS = ("order", "rays", "error", "bounces", "direct")


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="DIR", help="the bundle to write; an earlier one is replaced at the end")
    parser.add_argument("--technique", default="probes", metavar="NAME", help=f"one of {', '.join(techniques.names())}")
    parser.add_argument("--volume", action="append", metavar="NAME", help="bake only this volume; may be repeated")
    parser.add_argument("--order", type=int, metavar="L", help="order of the spherical harmonics")
    effort = parser.add_mutually_exclusive_group()
    effort.add_argument("--rays", type=int, metavar="N", help="a fixed number of rays per probe")
    effort.add_argument("--error", type=float, metavar="E", help="target relative error of the coefficients (default 0.01)")
    parser.add_argument("--bounces", type=int, metavar="N", help="how often light is reflected (default: until it has died away)")
    parser.add_argument("--direct", action="store_true", default=None, help="add the direct light of lamps to the probes")
    parser.add_argument("--seed", type=_at_least(0), default=0, metavar="S", help="the same seed gives the same bytes")
    parser.add_argument("--threads", type=_at_least(1), metavar="N", help="default: every core")
    parser.add_argument("--resume", action="store_true", help="continue an interrupted bake to the same --out")
    parser.add_argument("--checkpoint-seconds", type=_seconds, default=10.0, metavar="T",
                        help="how often an unfinished bake is saved (default 10)")
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu",
                        help="where the inner loops of a technique run that knows both (default cpu)")
    parser.add_argument("--picture", metavar="FILE.png", help="then draw the probes as spheres in the scene they light")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="assignments", type=_assignment,
                        help="any other setting of the technique; may be repeated")


def _overrides(arguments: argparse.Namespace) -> dict:
    """The settings that the command line names, by name."""
    given = {name: getattr(arguments, name) for name in _SETTING_OPTIONS if getattr(arguments, name) is not None}
    return {**dict(arguments.assignments), **given}


def _check(arguments: argparse.Namespace) -> None:
    method = techniques.registry().get(arguments.technique)
    if method is not None:
        build_settings(method, _overrides(arguments))


def _run(arguments: argparse.Namespace, session: Session) -> BakeSummary:
    # Everything that can fail without the file fails before it is read.
    require_device(techniques.get(arguments.technique), arguments.device)
    check_target(arguments.out)
    if arguments.device == "gpu":
        from ..gpu_context import open_context
        open_context()
    session.progress.stage("extract")
    scene = session.read_scene()
    return bake_scene(
        scene, arguments.technique, _overrides(arguments), arguments.out, seed=arguments.seed, threads=arguments.threads,
        progress=session.progress.span(EXTRACT_SHARE, 1.0), resume=arguments.resume, volume=arguments.volume,
        checkpoint_seconds=arguments.checkpoint_seconds, device=arguments.device, picture=arguments.picture)


def _at_least(low: int):
    def number(text: str) -> int:
        value = int(text)
        if value < low:
            raise argparse.ArgumentTypeError(f"{text} is less than {low}")
        return value

    return number


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number of seconds")
    return value


def _assignment(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name.strip(), value.strip()


SUBCOMMAND = Subcommand("bake", "bake every Light Probe Volume into a bundle", True, _add_arguments, _run, _check)
