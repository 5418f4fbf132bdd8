"""`plan`: the cheapest technique, lattice, order and rays that meet an error at surfaces, and why."""

import argparse

from ...evaluate.plan import Target
from ...evaluate.plan.choice import MOST_PROBES
from ...jobs.plan import PlanReport, plan_scene
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import at_least

_UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30}


def add_target(parser: argparse.ArgumentParser) -> None:
    """The options that say what a plan has to meet, but for `--error` and `--order`."""
    parser.add_argument("--memory", type=memory, metavar="SIZE", help="that the bake may take, as 512M or 2G (default: any)")
    parser.add_argument("--most-probes", type=at_least(1), default=MOST_PROBES, metavar="N",
                        help=f"that the lattices may have together (default {MOST_PROBES})")
    parser.add_argument("--keep-air", action="store_true",
                        help="keep probes that no surface reads, for things that move through the air")


def target_of(arguments: argparse.Namespace) -> Target:
    """What the command line asks for."""
    error = Target.error if arguments.error is None else arguments.error
    orders = Target.orders if arguments.order is None else (arguments.order,)
    return Target(error, arguments.memory, arguments.most_probes, orders, arguments.keep_air)


def memory(text: str) -> float:
    """Bytes from a number with K, M or G behind it; without one it is MiB."""
    unit = _UNITS.get(text[-1:].upper())
    value = float(text[:-1] if unit else text) * (unit or _UNITS["M"])
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a size")
    return value


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--error", type=float, metavar="E", help=f"relative error at surfaces (default {Target.error:g})")
    parser.add_argument("--order", type=at_least(0), metavar="L", help="SH order (default: 1 or 2, whichever is cheaper)")
    add_target(parser)
    parser.add_argument("--volume", action="append", metavar="NAME", help="plan only this volume; may be repeated")
    parser.add_argument("--probes-only", action="store_true", help="do not measure the other techniques for comparison")
    parser.add_argument("--seed", type=at_least(0), default=0, metavar="S", help="the same seed gives the same plan")
    parser.add_argument("--threads", type=at_least(1), metavar="N", help="default: every core")


def _run(arguments: argparse.Namespace, session: Session) -> PlanReport:
    from ..motion import find_motion  # needs Blender, which prints when it is loaded
    session.progress.stage("extract")
    scene = session.read_scene()
    return plan_scene(scene, target_of(arguments), seed=arguments.seed, threads=arguments.threads, volume=arguments.volume,
                      motion=find_motion(), others=not arguments.probes_only, progress=session.progress.span(EXTRACT_SHARE, 1.0))


SUBCOMMAND = Subcommand("plan", "say the cheapest bake that meets an error at surfaces, and why", True, _add_arguments, _run,
                        target_of)
