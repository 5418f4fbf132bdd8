"""`check`: what would spoil a bake of FILE, without one. Exit code 1 if a bake would be refused."""

import argparse

from ...jobs.check import CheckReport, check
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import at_least


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--threads", type=at_least(1), metavar="N", help="default: every core")


def _run(arguments: argparse.Namespace, session: Session) -> CheckReport:
    session.progress.stage("extract")
    scene = session.read_scene()
    return check(scene, threads=arguments.threads, progress=session.progress.span(EXTRACT_SHARE, 1.0))


SUBCOMMAND = Subcommand("check", "say what would spoil a bake, and what of the file is not followed", True, _add_arguments, _run)
