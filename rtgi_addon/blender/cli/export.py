"""`export`: a bundle into an engine's project."""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from ...effects.stylized.settings import StylizedSettings
from ...errors import UsageError
from ...exchange import engines
from ...exchange.engines import PARTS, ExportReport
from ...jobs.export import export_bundle
from ..styles import STYLES, style_settings
from .base import EXTRACT_SHARE, Session, Subcommand


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bundle", metavar="BUNDLE", help="the folder that `bake --out` wrote")
    parser.add_argument("--engine", required=True, metavar="NAME", help=f"one of {', '.join(engines.names())}")
    parser.add_argument("--out", required=True, metavar="DIR", help="the folder to write; files of an earlier export there are "
                                                                    "replaced at the end, unless somebody changed them")
    parser.add_argument("--part", choices=PARTS, default=PARTS[0], help="all: with a sample project around the probes (default); "
                                                                        "files: only the folder that goes into a project, into the "
                                                                        "one at --out")
    parser.add_argument("--model", metavar="FILE.glb", help="the scene as glTF Binary, shown by the sample scene; default: the "
                                                            "FILE, if there is one, written by Blender's own exporter")
    parser.add_argument("--style", metavar="NAME", help=f"write this style as well (one of {', '.join(STYLES)}, or a preset of "
                                                        f"your own in Blender), for {', '.join(engines.taking_styles())}")
    parser.add_argument("--no-conformance", action="store_true", help="leave out the kit that holds the engine to our numbers")


def _check(arguments: argparse.Namespace) -> None:
    engines.get(arguments.engine)
    if arguments.part != PARTS[0] and arguments.model is not None:
        raise UsageError("--model goes into the sample scene, which --part files leaves out", "leave out one of them")


def _run(arguments: argparse.Namespace, session: Session) -> ExportReport:
    style = None if arguments.style is None else StylizedSettings(**style_settings(arguments.style))

    def export(model, progress, missing=(), even=(), lost=(), sky=None) -> ExportReport:
        return export_bundle(arguments.bundle, arguments.engine, arguments.out, model=model, missing_lamps=missing, even_lamps=even,
                             lost=lost, sky=sky, style=style, conformance=not arguments.no_conformance, part=arguments.part,
                             progress=progress)

    if arguments.model is not None or not session.has_file or arguments.part != PARTS[0]:
        return export(arguments.model, session.progress)
    # Everything that can fail without the file fails before it is read.
    engines.get(arguments.engine).check_target(arguments.out, inputs=[arguments.bundle, *session.inputs])
    from ..model import export_model
    session.progress.step(0.0, "Reading the scene")
    session.open_file()
    from ..bundles import require_of_open_scene
    from ..extract import files_of_blend
    require_of_open_scene(arguments.bundle)
    engines.get(arguments.engine).check_target(arguments.out, inputs=files_of_blend())
    with TemporaryDirectory(prefix="rtgi") as folder:
        model = Path(folder) / "model.glb"
        made = export_model(model)
        return export(model, session.progress.span(EXTRACT_SHARE, 1.0), *made)


SUBCOMMAND = Subcommand("export", "write a bundle as an engine's textures, shaders and sample scene", True, _add_arguments, _run,
                        _check, needs_scene=False)
