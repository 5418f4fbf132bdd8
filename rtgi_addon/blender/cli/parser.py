"""The subcommands and the parser made of them; a new subcommand is one more entry."""

import argparse
import importlib
from collections.abc import Iterator, MutableMapping

from ...errors import UsageError
from .base import Subcommand
from .part import add_part

_NAMES = ("bake", "check", "verify", "plan", "render", "chart", "stability", "export", "info", "relight", "prepare", "merge",
          "farm")


class _Subcommands(MutableMapping):
    """Every subcommand by name, each a module of that name that is imported when it is asked for: a part of a bake is started a
    thousand times, and needs no charts."""

    def __init__(self):
        self._found: dict[str, Subcommand] = {}

    def __getitem__(self, name: str) -> Subcommand:
        if name not in _NAMES:
            raise KeyError(name)
        if name not in self._found:
            self._found[name] = importlib.import_module(f".{name}", __package__).SUBCOMMAND
        return self._found[name]

    def __setitem__(self, name: str, subcommand: Subcommand) -> None:
        self._found[name] = subcommand

    def __delitem__(self, name: str) -> None:
        del self._found[name]

    def __contains__(self, name) -> bool:
        return name in _NAMES

    def __iter__(self) -> Iterator[str]:
        return iter(_NAMES)

    def __len__(self) -> int:
        return len(_NAMES)


SUBCOMMANDS = _Subcommands()


class _Parser(argparse.ArgumentParser):
    """Answers wrong usage by UsageError instead of printing and leaving the process; takes no option for another that begins like
    it (`--frame` for `--frames`)."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **{**kwargs, "allow_abbrev": False})

    def error(self, message: str):
        raise UsageError(message[:1].lower() + message[1:], f"see `{self.prog} --help`")


def build_parser(prog: str, only: str | None = None) -> argparse.ArgumentParser:
    """The parser of the whole command line behind a door called ``prog``, or of the subcommand called ``only`` alone."""
    parser = _Parser(prog=prog, description="Bake real-time global illumination from Blender scenes.")
    subparsers = parser.add_subparsers(dest="subcommand", metavar="SUBCOMMAND", required=True)
    for entry in SUBCOMMANDS.values() if only is None else [SUBCOMMANDS[only]]:
        sub = subparsers.add_parser(entry.name, help=entry.help, description=entry.help.capitalize() + ".")
        entry.add_arguments(sub)
        if entry.takes_scene:
            add_part(sub)
        sub.add_argument("--json", action="store_true", help="print the result as one JSON object on stdout")
        sub.add_argument("--traceback", action="store_true", help="show where an error comes from, and what Blender prints")
    return parser
