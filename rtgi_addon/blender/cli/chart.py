"""`chart`: every technique at several settings, error against time, rays and memory; effects' pictures against time."""

import argparse

from ... import techniques
from ...jobs.chart import MOST_SECONDS, ChartReport, chart_scene, check_chart, known_techniques
from ...jobs.chart_pictures import known_effects
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import above_zero, at_least


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="DIR", help="where chart.json, chart.md and the pictures go")
    parser.add_argument("--techniques", nargs="*", metavar="NAME",
                        help=f"default: all of {', '.join(techniques.names())}, and atlas, the light atlas, where objects are in "
                             "it; with no name none, for pictures alone")
    parser.add_argument("--reference", choices=("path", "cycles"), default="path",
                        help="what is held to be right: this project's path tracer (default) or Cycles")
    parser.add_argument("--noise", type=above_zero, default=0.01, metavar="E",
                        help="relative noise of the reference (default 0.01)")
    parser.add_argument("--seeds", type=at_least(1), default=4, metavar="N", help="bakes of each setting (default 4)")
    parser.add_argument("--points", type=at_least(1), default=128, metavar="N",
                        help="surface points, under 4 normals each (default 128)")
    parser.add_argument("--probes", type=at_least(1), default=64, metavar="N", help="probes that are compared (default 64)")
    parser.add_argument("--volume", action="append", metavar="NAME", help="only this volume; may be repeated")
    parser.add_argument("--most-seconds", type=above_zero, default=MOST_SECONDS, metavar="S",
                        help=f"leave out settings dearer than one that took longer than this (default {MOST_SECONDS:g})")
    parser.add_argument("--no-maps", action="store_true", help="no pictures of where in the scene each technique is wrong")
    parser.add_argument("--effects", nargs="+", metavar="NAME",
                        help="whose pictures are held to Cycles' (default: all that have something to do in the scene)")
    parser.add_argument("--no-pictures", action="store_true", help="no pictures of effects")
    parser.add_argument("--threads", type=at_least(1), metavar="N", help="default: every core")
    parser.add_argument("--resume", action="store_true", help="go on from what an interrupted chart to the same --out has measured")


def _check(arguments: argparse.Namespace) -> None:
    known_techniques(arguments.techniques)
    known_effects(arguments.effects)


def _run(arguments: argparse.Namespace, session: Session) -> ChartReport:
    # Everything that can fail without the file fails before it is read.
    check_chart(arguments.out, session.inputs)
    session.progress.stage("extract")
    scene = session.read_scene()
    reference = None
    if arguments.reference == "cycles":
        from ..cycles.receivers import CyclesReference
        reference = CyclesReference(noise=arguments.noise, threads=arguments.threads)
    pictures = None
    if not arguments.no_pictures:
        from ..cycles.pictures import CyclesPictures
        pictures = CyclesPictures(threads=arguments.threads)
    return chart_scene(
        scene, arguments.out, arguments.techniques, seeds=arguments.seeds, points=arguments.points, probes=arguments.probes,
        noise=arguments.noise, volume=arguments.volume, maps=not arguments.no_maps, most_seconds=arguments.most_seconds,
        reference=reference, pictures=pictures, effects=arguments.effects, threads=arguments.threads, resume=arguments.resume,
        progress=session.progress.span(EXTRACT_SHARE, 1.0))


SUBCOMMAND = Subcommand("chart", "chart the speed of every technique against its accuracy", True, _add_arguments, _run, _check)
