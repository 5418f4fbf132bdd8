"""`stability`: what a FILE's scene does to each technique; without one, the scenes in which methods are known to fail."""

import argparse

from ... import techniques
from ...errors import UsageError
from ...evaluate.stability import CASES, StabilityReport, chosen
from ...evaluate.stability.own import OWN_NAMES
from ...jobs.stability import check_stability, run_stability
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import at_least


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", metavar="DIR", help="a folder for stability.md, stability.json and a picture of each worst case")
    parser.add_argument("--built-in", action="store_true", help="the built-in scenes, though there is a FILE")
    parser.add_argument("--case", action="append", metavar="NAME",
                        help=f"only this case; may be repeated: {', '.join(OWN_NAMES)} of a FILE; {', '.join(CASES)} without one")
    parser.add_argument("--technique", action="append", metavar="NAME", help="only this technique; may be repeated")
    parser.add_argument("--no-variants", action="store_true", help="leave out the runs without remedies")
    parser.add_argument("--no-pictures", action="store_true", help="draw nothing")
    parser.add_argument("--seed", type=at_least(0), default=1, metavar="S", help="random numbers of every bake (default 1)")
    parser.add_argument("--threads", type=at_least(1), metavar="N", help="default: every core")
    parser.add_argument("--resume", action="store_true", help="go on from what an interrupted run to the same --out has measured")


def _check(arguments: argparse.Namespace) -> None:
    for name in arguments.case or ():
        if name not in CASES and name not in OWN_NAMES:
            chosen([name])
    for name in arguments.technique or ():
        if not any(name in case.limits for case in CASES.values()):
            techniques.get(name)
    if arguments.resume and arguments.out is None:
        raise UsageError("--resume goes on from what lies beside --out", "add --out, or leave out --resume")


def _run(arguments: argparse.Namespace, session: Session) -> StabilityReport:
    # Everything that can fail without the file fails before it is read.
    if arguments.out is not None:
        check_stability(arguments.out, session.inputs)
    scene, progress = None, session.progress
    if session.has_file and not arguments.built_in:
        scene, progress = session.read_scene(), progress.span(EXTRACT_SHARE, 1.0)
    return run_stability(arguments.out, scene, cases=arguments.case, techniques=arguments.technique,
                         variants=not arguments.no_variants, pictures=not arguments.no_pictures, seed=arguments.seed,
                         threads=arguments.threads, resume=arguments.resume, progress=progress)


SUBCOMMAND = Subcommand("stability", "measure how techniques stand a scene, or those in which methods fail", True, _add_arguments,
                        _run, _check, needs_scene=False)
