"""`farm`: the parts of a prepared bake on a cluster of Dask's `distributed`."""

import argparse

from ...exchange.bundle import check_target
from ...jobs.farm import farm_bake
from .base import Report, Session, Subcommand
from .options import at_least


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("prepared", metavar="PREP", help="the folder that `prepare --out` wrote, at one path for all machines")
    parser.add_argument("--scheduler", required=True, metavar="ADDRESS", help="the cluster's scheduler, tcp://HOST:8786")
    parser.add_argument("--parts", type=at_least(1), required=True, metavar="N",
                        help="how many parts to cut the bake into: some four for each worker")
    parser.add_argument("--out", required=True, metavar="DIR", help="the bundle to write; parts go to DIR.parts meanwhile")


def _run(arguments: argparse.Namespace, session: Session) -> Report:
    check_target(arguments.out, inputs=(arguments.prepared,))
    return farm_bake(arguments.prepared, arguments.scheduler, arguments.parts, arguments.out, progress=session.progress)


SUBCOMMAND = Subcommand("farm", "bake a prepared bake on a cluster", False, _add_arguments, _run)
