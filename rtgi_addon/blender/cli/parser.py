"""The subcommands and the parser made of them; a new subcommand is one more entry."""

import argparse

from ...errors import UsageError
from . import bake, chart, export, info, plan, render, stability

SUBCOMMANDS = {entry.name: entry for entry in (bake.SUBCOMMAND, plan.SUBCOMMAND, render.SUBCOMMAND, chart.SUBCOMMAND,
                                           stability.SUBCOMMAND, export.SUBCOMMAND, info.SUBCOMMAND)}


class _Parser(argparse.ArgumentParser):
    """Answers wrong usage by UsageError instead of printing and leaving the process."""

    def error(self, message: str):
        raise UsageError(message[:1].lower() + message[1:], f"see `{self.prog} --help`")


def build_parser(prog: str) -> argparse.ArgumentParser:
    """The parser of the whole command line behind a door called ``prog``."""
    parser = _Parser(prog=prog, description="Bake real-time global illumination from Blender scenes.")
    subparsers = parser.add_subparsers(dest="subcommand", metavar="SUBCOMMAND", required=True)
    for entry in SUBCOMMANDS.values():
        sub = subparsers.add_parser(entry.name, help=entry.help, description=entry.help.capitalize() + ".")
        entry.add_arguments(sub)
        if entry.takes_scene:
            sub.add_argument("--import", dest="imported", metavar="FILE.glb", help="read a glTF file through Blender's importer")
        sub.add_argument("--json", action="store_true", help="print the result as one JSON object on stdout")
        sub.add_argument("--traceback", action="store_true", help="show where an error comes from, and what Blender prints")
    return parser
