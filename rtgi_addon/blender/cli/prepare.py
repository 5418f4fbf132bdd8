"""`prepare`: all that a bake needs of its file, into a folder that can be baked anywhere, in parts."""

import argparse

from ...exchange.array_folder import check_folder_target
from ...exchange.prepared import PREPARED
from ...jobs.prepare import prepare_scene
from .base import EXTRACT_SHARE, Report, Session, Subcommand
from .options import add_technique, check_technique, overrides, sphere_settings


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="PREP", help="the folder to write; an earlier one is replaced at the end")
    add_technique(parser)


def _run(arguments: argparse.Namespace, session: Session) -> Report:
    check_folder_target(PREPARED, arguments.out, inputs=session.inputs)
    session.progress.stage("extract")
    return prepare_scene(
        session.read_scene(), arguments.technique, overrides(arguments), arguments.out, seed=arguments.seed,
        threads=arguments.threads, volume=arguments.volume, spheres=sphere_settings(arguments),
        progress=session.progress.span(EXTRACT_SHARE, 1.0))


def _check(arguments: argparse.Namespace) -> None:
    check_technique(arguments)
    sphere_settings(arguments)


SUBCOMMAND = Subcommand("prepare", "prepare a bake, to be made elsewhere or in parts", True, _add_arguments, _run, _check)
