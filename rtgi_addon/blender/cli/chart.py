"""`chart`: every technique at several settings, error against time, rays and memory."""

import argparse

from ... import techniques
from ...jobs.chart import MOST_SECONDS, ChartReport, chart_scene
from .base import EXTRACT_SHARE, Session, Subcommand


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="DIR", help="where chart.json, chart.md and the pictures go")
    parser.add_argument("--techniques", nargs="+", metavar="NAME", help=f"default: all of {', '.join(techniques.names())}")
    parser.add_argument("--reference", choices=("path", "cycles"), default="path",
                        help="what is held to be right: this project's path tracer (default) or Cycles")
    parser.add_argument("--noise", type=_positive, default=0.01, metavar="E",
                        help="relative noise of the reference (default 0.01)")
    parser.add_argument("--seeds", type=_count, default=4, metavar="N", help="bakes of each setting (default 4)")
    parser.add_argument("--points", type=_count, default=128, metavar="N",
                        help="surface points, under 4 normals each (default 128)")
    parser.add_argument("--probes", type=_count, default=64, metavar="N", help="probes that are compared (default 64)")
    parser.add_argument("--volume", action="append", metavar="NAME", help="only this volume; may be repeated")
    parser.add_argument("--most-seconds", type=_positive, default=MOST_SECONDS, metavar="S",
                        help=f"leave out settings dearer than one that took longer than this (default {MOST_SECONDS:g})")
    parser.add_argument("--no-maps", action="store_true", help="no pictures of where in the scene each technique is wrong")
    parser.add_argument("--threads", type=_count, metavar="N", help="default: every core")


def _check(arguments: argparse.Namespace) -> None:
    for name in arguments.techniques or ():
        techniques.get(name)


def _run(arguments: argparse.Namespace, session: Session) -> ChartReport:
    session.progress.stage("extract")
    scene = session.read_scene()
    reference = None
    if arguments.reference == "cycles":
        from ..cycles_receivers import CyclesReference
        reference = CyclesReference(noise=arguments.noise, threads=arguments.threads)
    return chart_scene(
        scene, arguments.out, arguments.techniques, seeds=arguments.seeds, points=arguments.points, probes=arguments.probes,
        noise=arguments.noise, volume=arguments.volume, maps=not arguments.no_maps, most_seconds=arguments.most_seconds,
        reference=reference, threads=arguments.threads, progress=session.progress.span(EXTRACT_SHARE, 1.0))


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is less than 1")
    return value


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


SUBCOMMAND = Subcommand("chart", "chart the speed of every technique against its accuracy", True, _add_arguments, _run, _check)
