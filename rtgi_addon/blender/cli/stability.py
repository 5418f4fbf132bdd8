"""`stability`: the scenes in which methods are known to fail, and how much ours do."""

import argparse

from ...errors import BakeError
from ...evaluate.stability import CASES, StabilityReport, chosen
from ...jobs.stability import run_stability
from .base import Session, Subcommand


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", metavar="DIR", help="a folder for stability.md, stability.json and a picture of each worst case")
    parser.add_argument("--case", action="append", metavar="NAME", help=f"only this case; may be repeated: {', '.join(CASES)}")
    parser.add_argument("--technique", action="append", metavar="NAME", help="only this technique; may be repeated")
    parser.add_argument("--no-variants", action="store_true", help="leave out the runs without remedies")
    parser.add_argument("--no-pictures", action="store_true", help="draw nothing")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="random numbers of every bake (default 1)")
    parser.add_argument("--threads", type=int, metavar="N", help="default: every core")


def _check(arguments: argparse.Namespace) -> None:
    chosen(arguments.case, arguments.technique)


def _run(arguments: argparse.Namespace, session: Session) -> StabilityReport:
    report = run_stability(arguments.out, cases=arguments.case, techniques=arguments.technique, variants=not arguments.no_variants,
                           pictures=not arguments.no_pictures, seed=arguments.seed, threads=arguments.threads,
                           progress=session.progress)
    if report.worse:
        names = ", ".join(f"{result.case.name} of {result.technique} ({result.figure:.3g}, bound {result.limit.bound:g})"
                          for result in report.worse)
        raise BakeError(f"worse than the stored bounds: {names}", f"see it alone with: {report.worse[0].command}")
    return report


SUBCOMMAND = Subcommand("stability", "measure how techniques stand the scenes where methods fail", False, _add_arguments, _run,
                        _check)
