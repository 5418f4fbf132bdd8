"""`bake`: every Light Probe Volume of the file into a bundle."""

import argparse

from ... import techniques
from ...exchange.bundle import check_target
from ...jobs.bake import bake_scene, require_device
from ...jobs.report import BakeSummary
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import add_technique, check_technique, overrides


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="DIR", help="the bundle to write; an earlier one is replaced at the end")
    add_technique(parser)
    parser.add_argument("--resume", action="store_true", help="continue an interrupted bake to the same --out")
    parser.add_argument("--checkpoint-seconds", type=_seconds, default=10.0, metavar="T",
                        help="how often an unfinished bake is saved (default 10)")
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu",
                        help="where the inner loops of a technique run that knows both (default cpu)")
    parser.add_argument("--picture", metavar="FILE.png", help="then draw the probes as spheres in the scene they light")


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
        scene, arguments.technique, overrides(arguments), arguments.out, seed=arguments.seed, threads=arguments.threads,
        progress=session.progress.span(EXTRACT_SHARE, 1.0), resume=arguments.resume, volume=arguments.volume,
        checkpoint_seconds=arguments.checkpoint_seconds, device=arguments.device, picture=arguments.picture)


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number of seconds")
    return value


SUBCOMMAND = Subcommand("bake", "bake every Light Probe Volume into a bundle", True, _add_arguments, _run, check_technique)
