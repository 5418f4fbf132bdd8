"""The two doors of the command line, and what both share: streams, Ctrl-C, exit codes."""

import json
import signal
import sys
import traceback
from argparse import Namespace
from collections.abc import Callable
from contextlib import ExitStack, nullcontext

from ...errors import BakeError, Cancelled, UsageError
from ...jobs.console import ConsoleProgress
from ...progress import Progress
from ...scene import Scene
from .base import EXTRACT_SHARE, Session
from .parser import SUBCOMMANDS, build_parser
from .streams import Streams

DONE, FAILED, WRONG_USAGE, CANCELLED = 0, 1, 2, 130

_handle = None


def main_module(argv: list[str]) -> int:
    """`python -m rtgi_addon [FILE] SUBCOMMAND …`: the exit code. FILE is a .blend, .glb or .gltf."""
    file, rest = None, list(argv)
    if rest and not rest[0].startswith("-") and rest[0] not in SUBCOMMANDS:
        file, rest = rest[0], rest[1:]

    def require_file(arguments: Namespace) -> None:
        subcommand = SUBCOMMANDS[arguments.subcommand]
        if file is not None and not subcommand.takes_scene:
            raise UsageError(f"{arguments.subcommand} takes no FILE, and {file!r} stands before it", "leave it out")
        files = (file is not None) + (getattr(arguments, "imported", None) is not None)
        if subcommand.takes_scene and (files > 1 or (subcommand.needs_scene and files == 0)):
            raise UsageError(f"{arguments.subcommand} needs one file", "name a .blend, .glb or .gltf before it")

    with ExitStack() as stack:
        def read(arguments: Namespace) -> None:
            from .open_file import known_properties, open_file
            stack.enter_context(known_properties())
            open_file(file or arguments.imported)

        return _run(rest, "python -m rtgi_addon [FILE]", read, lambda: file is not None, require_file)


def main_blender(argv: list[str]) -> int:
    """`blender -b FILE.blend --command rtgi SUBCOMMAND …`: the exit code. ``argv`` is what follows `rtgi`."""
    def read(arguments: Namespace) -> None:
        from .open_file import take_open_file
        take_open_file(arguments.imported)

    def is_open() -> bool:
        import bpy
        return bool(bpy.data.filepath)

    with _window():
        return _run(list(argv), "blender -b FILE.blend --command rtgi", read, is_open)


def _window():
    """The file's own window as context. Blender gives commands none, and without one the context lacks what belongs to a screen
    (its glTF exporter asks for the active object)."""
    import bpy
    windows = bpy.context.window_manager.windows
    if bpy.context.window is not None or not len(windows):
        return nullcontext()
    return bpy.context.temp_override(window=windows[0])


def register() -> None:
    """Give Blender the command `rtgi`."""
    global _handle
    import bpy
    _handle = bpy.utils.register_cli_command("rtgi", main_blender)


def unregister() -> None:
    """Take the command back."""
    global _handle
    import bpy
    if _handle is not None:
        bpy.utils.unregister_cli_command(_handle)
        _handle = None


def _run(argv: list[str], prog: str, open_scene: Callable[[Namespace], None], has_file: Callable[[], bool], check_file=None) -> int:
    """Parse, run and report. ``open_scene`` brings the file into Blender, ``has_file`` says whether there is one beside --import;
    ``check_file`` raises UsageError."""
    try:
        arguments = build_parser(prog).parse_args(argv)
        subcommand = SUBCOMMANDS[arguments.subcommand]
        for check in (check_file, subcommand.check):
            if check is not None:
                check(arguments)
    except UsageError as error:
        _complain(sys.stderr, error)
        return WRONG_USAGE
    except SystemExit as done:
        # argparse leaves this way after --help.
        return int(done.code or DONE)

    streams = Streams(loud=arguments.traceback)
    console = ConsoleProgress(streams.err)
    progress = Progress(console)

    def read_scene() -> Scene:
        progress.step(0.0, "Reading the scene")
        from ..extract import extract_scene
        open_scene(arguments)
        progress.check()
        return extract_scene(progress=progress.span(0.0, EXTRACT_SHARE))

    try:
        with _interruptible(progress):
            named = getattr(arguments, "imported", None) is not None or has_file()
            report = subcommand.run(arguments, Session(progress, read_scene, named, lambda: open_scene(arguments)))
        console.close()
        streams.out.write((json.dumps(report.to_json(), indent=1) if arguments.json else report.to_text()) + "\n")
        streams.out.flush()
        return DONE
    except BrokenPipeError:
        return DONE
    except BaseException as error:
        console.close()
        if arguments.traceback:
            traceback.print_exc(file=streams.err)
        if isinstance(error, (Cancelled, KeyboardInterrupt)):
            kept = f": {error}" if isinstance(error, Cancelled) and str(error) else ""
            streams.err.write(f"rtgi: cancelled{kept}\n")
            streams.err.flush()
            return CANCELLED
        _complain(streams.err, error)
        return FAILED


def _complain(stream, error: BaseException) -> None:
    """One line: what, where, remedy."""
    if isinstance(error, MemoryError):
        error = BakeError("there is not enough memory for this bake", "lower the resolution, the order or the textures")
    elif not isinstance(error, BakeError):
        where = traceback.extract_tb(error.__traceback__)[-1]
        error = BakeError(f"internal error, {type(error).__name__}: {error} ({where.name}, line {where.lineno})",
                          "please report it with the output of --traceback")
    stream.write("rtgi: error: " + " ".join(str(error).split()) + "\n")
    stream.flush()


class _interruptible:
    """Ctrl-C asks ``progress`` to cancel, so that the bake ends in order; a second one ends it at once."""

    def __init__(self, progress: Progress):
        self._progress = progress

    def __enter__(self):
        self._before = signal.signal(signal.SIGINT, self._interrupt)

    def __exit__(self, *_):
        # None stands for a handler of Blender's own, which Python cannot put back.
        signal.signal(signal.SIGINT, self._before or signal.SIG_DFL)

    def _interrupt(self, signum, frame):
        if self._progress.cancelled:
            raise KeyboardInterrupt
        self._progress.cancel()
