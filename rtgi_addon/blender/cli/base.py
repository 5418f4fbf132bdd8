"""What a subcommand is."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from ...progress import Progress
from ...scene import Scene

# The share of a command's progress that reading the file is given.
EXTRACT_SHARE = 0.05


class Report(Protocol):
    """A subcommand's result: ``to_json()`` is printed by `--json`, ``to_text()`` without. One that has found something wrong may
    have a BakeError as ``refusal``: then the command has failed."""

    def to_json(self) -> dict:
        """The result as JSON-able values."""

    def to_text(self) -> str:
        """The result as lines for a person."""


@dataclass(frozen=True)
class Session:
    """What a door hands to a subcommand: ``progress`` to report to and be cancelled by, and ``read_scene`` which opens the
    FILE (or takes the one that is open) and extracts it; ``open_file`` only opens it. Nothing else here touches Blender.
    ``has_file`` says whether there is a FILE, for those that can do without; ``inputs`` are the files it will be read from, as far
    as they are known before. ``read_frame`` reads the scene of another frame of the same FILE."""

    progress: Progress
    read_scene: Callable[[], Scene]
    has_file: bool = True
    open_file: Callable[[], None] = lambda: None
    inputs: tuple[str, ...] = ()
    read_frame: Callable[[int, Progress], Scene] | None = None


@dataclass(frozen=True)
class Subcommand:
    """One entry of the command line. ``takes_scene`` says that it works on a FILE, ``needs_scene`` that it cannot do without;
    ``add_arguments`` declares its options; ``check`` (optional) raises UsageError for options that contradict each other or a
    technique, before anything is opened; ``run`` does the work."""

    name: str
    help: str
    takes_scene: bool
    add_arguments: Callable[[ArgumentParser], None]
    run: Callable[[Namespace, Session], Report]
    check: Callable[[Namespace], None] | None = None
    needs_scene: bool = True
