"""`export`: a bundle into an engine's project."""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from ...exchange import engines
from ...exchange.engines import ExportReport
from ...jobs.export import export_bundle
from .base import EXTRACT_SHARE, Session, Subcommand


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bundle", metavar="BUNDLE", help="the folder that `bake --out` wrote")
    parser.add_argument("--engine", required=True, metavar="NAME", help=f"one of {', '.join(engines.names())}")
    parser.add_argument("--out", required=True, metavar="DIR", help="the folder to write; an earlier export is replaced at the end")
    parser.add_argument("--model", metavar="FILE.glb", help="the scene as glTF Binary, shown by the sample scene; default: the "
                                                            "FILE, if there is one, written by Blender's own exporter")
    parser.add_argument("--no-conformance", action="store_true", help="leave out the kit that holds the engine to our numbers")


def _check(arguments: argparse.Namespace) -> None:
    engines.get(arguments.engine)


def _run(arguments: argparse.Namespace, session: Session) -> ExportReport:
    def export(model, progress, notes=()) -> ExportReport:
        return export_bundle(arguments.bundle, arguments.engine, arguments.out, model=model, model_notes=notes,
                             conformance=not arguments.no_conformance, progress=progress)

    if arguments.model is not None or not session.has_file:
        return export(arguments.model, session.progress)
    # Everything that can fail without the file fails before it is read.
    engines.get(arguments.engine).check_target(arguments.out)
    from ..model import export_model
    session.progress.step(0.0, "Reading the scene")
    session.open_file()
    with TemporaryDirectory(prefix="rtgi") as folder:
        model = Path(folder) / "model.glb"
        notes = export_model(model)
        return export(model, session.progress.span(EXTRACT_SHARE, 1.0), notes)


SUBCOMMAND = Subcommand("export", "write a bundle as an engine's textures, shaders and sample scene", True, _add_arguments, _run,
                        _check, needs_scene=False)
