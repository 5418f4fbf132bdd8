"""`merge`: the parts of a bake into one bundle."""

import argparse

from ...jobs.prepared_bake import merge_parts
from .base import Report, Session, Subcommand


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("parts", nargs="+", metavar="PART", help="the folders that `bake PREP --part K/N` wrote, all of them")
    parser.add_argument("--out", required=True, metavar="DIR", help="the bundle to write; an earlier one is replaced at the end")


def _run(arguments: argparse.Namespace, session: Session) -> Report:
    return merge_parts(arguments.parts, arguments.out, progress=session.progress)


SUBCOMMAND = Subcommand("merge", "merge the parts of a bake into the bundle", False, _add_arguments, _run)
