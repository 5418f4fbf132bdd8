"""`export`: a bundle into an engine's project."""

import argparse

from ...exchange import engines
from ...exchange.engines import ExportReport
from ...jobs.export import export_bundle
from .base import Session, Subcommand


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bundle", metavar="BUNDLE", help="the folder that `bake --out` wrote")
    parser.add_argument("--engine", required=True, metavar="NAME", help=f"one of {', '.join(engines.names())}")
    parser.add_argument("--out", required=True, metavar="DIR", help="the folder to write; an earlier export is replaced at the end")
    parser.add_argument("--model", metavar="FILE.glb", help="the scene as glTF Binary, shown by the sample scene")
    parser.add_argument("--no-conformance", action="store_true", help="leave out the kit that holds the engine to our numbers")


def _check(arguments: argparse.Namespace) -> None:
    engines.get(arguments.engine)


def _run(arguments: argparse.Namespace, session: Session) -> ExportReport:
    return export_bundle(arguments.bundle, arguments.engine, arguments.out, model=arguments.model,
                         conformance=not arguments.no_conformance, progress=session.progress)


SUBCOMMAND = Subcommand("export", "write a bundle as an engine's textures, shaders and sample scene", False, _add_arguments, _run,
                        _check)
