"""`bake`: every Light Probe Volume of the file into a bundle."""

import argparse

from ... import techniques
from ...errors import UsageError
from ...exchange.bundle import check_target
from ...jobs.bake import bake_scene, require_device
from ...jobs.plan import PlannedBake, bake_planned
from ...jobs.report import BakeSummary
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import PLANNED, add_technique, check_technique, overrides
from .plan import add_target, target_of


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="DIR", help="the bundle to write; an earlier one is replaced at the end")
    add_technique(parser, planned=True)
    parser.add_argument("--resume", action="store_true", help="continue an interrupted bake to the same --out")
    parser.add_argument("--checkpoint-seconds", type=_seconds, default=10.0, metavar="T",
                        help="how often an unfinished bake is saved (default 10)")
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu",
                        help="where the inner loops of a technique run that knows both (default cpu)")
    parser.add_argument("--picture", metavar="FILE.png", help="then draw the probes as spheres in the scene they light")
    planned = parser.add_argument_group(f"with --technique {PLANNED}")
    add_target(planned)
    planned.add_argument("--no-check", action="store_true", help="do not measure how good the plan was after the bake")


def _check(arguments: argparse.Namespace) -> None:
    if arguments.technique != PLANNED:
        check_technique(arguments)
        if arguments.memory is not None or arguments.keep_air or arguments.no_check:
            raise UsageError("--memory, --keep-air and --no-check are for a plan", f"add --technique {PLANNED}")
        return
    if arguments.device != "cpu":
        raise UsageError("a planned bake runs on the CPU", "leave out --device, or name a technique")
    chosen = [name for name in ("rays", "bounces", "preset") if getattr(arguments, name) is not None]
    chosen += [name for name, _ in arguments.assignments]
    if chosen:
        raise UsageError(f"--technique {PLANNED} chooses {chosen[0]} itself", "leave it out, or name a technique")
    target_of(arguments)


def _run(arguments: argparse.Namespace, session: Session) -> BakeSummary | PlannedBake:
    from ..motion import find_motion  # needs Blender, which prints when it is loaded
    # Everything that can fail without the file fails before it is read.
    if arguments.technique != PLANNED:
        require_device(techniques.get(arguments.technique), arguments.device)
    check_target(arguments.out)
    if arguments.device == "gpu":
        from ..gpu_context import open_context
        open_context()
    session.progress.stage("extract")
    scene = session.read_scene()
    if arguments.technique == PLANNED:
        return bake_planned(
            scene, target_of(arguments), arguments.out, seed=arguments.seed, threads=arguments.threads, volume=arguments.volume,
            motion=find_motion(), check=not arguments.no_check, direct=bool(arguments.direct), resume=arguments.resume,
            checkpoint_seconds=arguments.checkpoint_seconds, picture=arguments.picture,
            progress=session.progress.span(EXTRACT_SHARE, 1.0))
    return bake_scene(
        scene, arguments.technique, overrides(arguments), arguments.out, seed=arguments.seed, threads=arguments.threads,
        progress=session.progress.span(EXTRACT_SHARE, 1.0), resume=arguments.resume, volume=arguments.volume,
        checkpoint_seconds=arguments.checkpoint_seconds, device=arguments.device, picture=arguments.picture)


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number of seconds")
    return value


SUBCOMMAND = Subcommand("bake", "bake every Light Probe Volume into a bundle", True, _add_arguments, _run, _check)
