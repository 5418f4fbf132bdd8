"""The two doors of the command line, and what both share: streams, signals, exit codes."""

import json
import sys
import traceback
from argparse import Namespace
from collections.abc import Callable
from contextlib import ExitStack, nullcontext, suppress
from dataclasses import replace
from pathlib import Path

from ...errors import BakeError, Cancelled, UsageError, out_of_memory
from ...interrupts import Interrupts
from ...jobs.console import ConsoleProgress
from ...machine.memory import share_arenas
from ...progress import Progress
from ...scene import Omission, Scene
from ...storage.files import disk_error
from ...storage.paths import resolved
from ...storage.workplace import can_resume
from ...words import one_line, printable
from .base import EXTRACT_SHARE, Session
from .parser import SUBCOMMANDS, build_parser
from .part import accepted, choose_part
from .room import require_room_for_blender
from .streams import Streams

# Whatever raises a UsageError, before the file is opened or after, the call was wrong; any other failure is one.
DONE, FAILED, WRONG_USAGE, CANCELLED = 0, 1, 2, 130
_SCENE_FILES = (".blend", ".glb", ".gltf")

_handle = None


def main_module(argv: list[str], interrupts: Interrupts | None = None) -> int:
    """`python -m rtgi_addon [FILE] SUBCOMMAND …`, or SUBCOMMAND FILE …: the exit code. FILE is a .blend, .glb or .gltf.
    ``interrupts`` are those that the process has heeded from its start."""
    share_arenas()
    file, rest = None, list(argv)
    if rest and not rest[0].startswith("-") and rest[0] not in SUBCOMMANDS:
        file, rest = rest[0], rest[1:]

    def require_file(arguments: Namespace, more: list[str]) -> None:
        nonlocal file
        subcommand = SUBCOMMANDS[arguments.subcommand]
        if file is None and subcommand.takes_scene and len(more) == 1 and not more[0].startswith("-"):
            file, more = more[0], []
            bundle = getattr(arguments, "bundle", None)
            # `export FILE BUNDLE`: the first of the two was taken for the bundle.
            if arguments.subcommand == "export" and bundle.lower().endswith(_SCENE_FILES):
                file, arguments.bundle = bundle, file
        if more:
            raise UsageError(f"unrecognized arguments: {' '.join(more)}", f"see `{_prog()} {arguments.subcommand} --help`")
        if file is not None and not file.strip():
            raise UsageError("the name of the FILE is empty", "name a .blend, .glb or .gltf")
        if file is not None and not subcommand.takes_scene:
            raise UsageError(f"{arguments.subcommand} takes no FILE, and {file!r} stands before it", "leave it out")
        prepared = getattr(arguments, "prepared", None) if subcommand.takes_scene else None
        if prepared is not None and not Path(prepared).is_dir():
            # `bake FILE`: the file was taken for a folder.
            if file is not None:
                raise UsageError(f"{arguments.subcommand} needs one file, and was given {file} and {prepared}", "leave one out")
            file, prepared, arguments.prepared = prepared, None, None
        if prepared is not None and (file is not None or arguments.imported is not None):
            raise UsageError(f"{prepared} is prepared, and no FILE is needed", "leave the FILE out")
        files = (file is not None) + (getattr(arguments, "imported", None) is not None)
        if subcommand.takes_scene and (files > 1 or (subcommand.needs_scene and files == 0 and prepared is None)):
            raise UsageError(f"{arguments.subcommand} needs one file", "name a .blend, .glb or .gltf before or after it")

    with ExitStack() as stack:
        interrupts = interrupts or stack.enter_context(Interrupts())

        def read(arguments: Namespace) -> tuple[Omission, ...]:
            from .open_file import known_properties, open_file
            stack.enter_context(known_properties())
            return open_file(file or arguments.imported, scripts=arguments.enable_scripts)

        return _run(rest, f"{_prog()} [FILE]", interrupts, read, lambda: file or "", require_file)


def _prog() -> str:
    """How the module's door was opened."""
    return "rtgi" if Path(sys.argv[0]).stem == "rtgi" else "python -m rtgi_addon"


def main_blender(argv: list[str]) -> int:
    """`blender -b FILE.blend --command rtgi SUBCOMMAND …`: the exit code. ``argv`` is what follows `rtgi`."""
    def path_of_file() -> str:
        import bpy
        return bpy.data.filepath

    with ExitStack() as stack:
        interrupts = stack.enter_context(Interrupts())

        def read(arguments: Namespace) -> tuple[Omission, ...]:
            from .open_file import take_open_file
            not_taken_in = take_open_file(arguments.imported, scripts=arguments.enable_scripts)
            # Only now: opening a file may put other windows in place of those before.
            stack.enter_context(_window())
            return not_taken_in

        return _run(list(argv), "blender -b FILE.blend --command rtgi", interrupts, read, path_of_file)


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


def _run(argv: list[str], prog: str, interrupts: Interrupts, open_scene: Callable[[Namespace], tuple[Omission, ...]],
         path_of_file: Callable[[], str], check_file=None) -> int:
    """Parse, run and report, until ``interrupts`` say otherwise. ``open_scene`` brings the file into Blender and says what did not
    come along, ``path_of_file`` is "" if there is none beside --import; ``check_file`` raises UsageError."""
    try:
        only = argv[0] if argv and argv[0] in SUBCOMMANDS else None
        arguments, more = build_parser(prog, only).parse_known_args(argv)
        subcommand = SUBCOMMANDS[arguments.subcommand]
        if check_file is not None:
            check_file(arguments, more)
        elif more:
            raise UsageError(f"unrecognized arguments: {' '.join(more)}", f"see `{prog} {arguments.subcommand} --help`")
        if subcommand.check is not None:
            subcommand.check(arguments)
    except UsageError as error:
        return _fail(sys.stderr, sys.stdout if "--json" in argv else None, error)
    except SystemExit as done:
        # argparse leaves this way after --help.
        return int(done.code or DONE)

    streams = Streams(loud=arguments.traceback)
    console = ConsoleProgress(streams.err)
    progress = Progress(console)
    interrupts.on_stop(progress.cancel)

    def read_scene() -> Scene:
        progress.step(0.0, "Reading the scene")
        from ..extract import extract_scene
        not_taken_in = open_part()
        progress.check()
        scene = extract_scene(progress=progress.span(0.0, EXTRACT_SHARE))
        return accepted(replace(scene, omissions=(*not_taken_in, *scene.omissions)), arguments)

    opened: list[tuple[Omission, ...]] = []

    def read_frame(frame: int, part: Progress) -> Scene:
        from ..frames import read_at
        if not opened:
            opened.append(open_part())
        scene = read_at(frame, part)
        return accepted(replace(scene, omissions=(*opened[0], *scene.omissions)), arguments)

    def open_part() -> tuple[Omission, ...]:
        not_taken_in = open_scene(arguments)
        choose_part(arguments)
        return not_taken_in

    try:
        progress.check()
        inputs = tuple(filter(None, (path_of_file(), getattr(arguments, "imported", None))))
        if inputs:
            require_room_for_blender()
        _say_if_nothing_to_resume(arguments, streams.err)
        report = subcommand.run(arguments, Session(progress, read_scene, bool(inputs), open_part, inputs, read_frame))
        console.close()
        refusal = getattr(report, "refusal", None)
        if arguments.json:
            failed = {} if refusal is None else {"error": _error_json(refusal)}
            _print(streams.out, json.dumps({**report.to_json(), **failed}, indent=1))
        else:
            _print(streams.out, printable(report.to_text()))
        return DONE if refusal is None else _fail(streams.err, None, refusal)
    except BaseException as error:
        console.close()
        if arguments.traceback:
            streams.err.write(printable("".join(traceback.format_exception(error))))
        if isinstance(error, (Cancelled, KeyboardInterrupt)):
            kept = f": {one_line(str(error))}" if isinstance(error, Cancelled) and str(error) else ""
            _say(streams.err, f"rtgi: cancelled{kept}")
            if arguments.json:
                _say_json(streams.out, {"message": f"cancelled{kept}", "cause": "cancelled", "remedy": "", "exit_code": CANCELLED})
            return CANCELLED
        return _fail(streams.err, streams.out if arguments.json else None, error)


def _print(stream, text: str) -> None:
    """The result. Raises BakeError where it cannot be written; a reader that has seen enough is none of our business."""
    try:
        stream.write(text + "\n")
        stream.flush()
    except BrokenPipeError:
        return
    except OSError as error:
        raise disk_error("the result", error) from error


def _say(stream, line: str) -> None:
    # Nobody is left to tell where nobody listens; the exit code still says it.
    with suppress(OSError, ValueError):
        stream.write(line + "\n")
        stream.flush()


def _say_if_nothing_to_resume(arguments: Namespace, stream) -> None:
    """So that nobody who asks to go on takes a new beginning for that."""
    if not getattr(arguments, "resume", False) or arguments.out is None:
        return
    out = resolved(arguments.out, "--out")
    if not (can_resume(out) or (getattr(arguments, "frames", None) is not None and out.is_dir() and any(out.iterdir()))):
        _say(stream, one_line(f"rtgi: note: beside {arguments.out} is nothing to go on from: it begins anew"))


def _fail(stream, json_stream, error: BaseException) -> int:
    """Say on ``stream`` in one line what, where and what to do, and on ``json_stream`` (None: nowhere) the same as an object; the
    exit code."""
    error = _as_told(error)
    _say(stream, "rtgi: error: " + one_line(" ".join(str(error).split())))
    if json_stream is not None:
        _say_json(json_stream, _error_json(error))
    return _exit_code(error)


def _exit_code(error: BakeError) -> int:
    return WRONG_USAGE if isinstance(error, UsageError) else FAILED


def _error_json(error: BakeError) -> dict:
    return {"message": str(error), "cause": error.cause, "remedy": error.remedy, "exit_code": _exit_code(error)}


def _say_json(stream, error: dict) -> None:
    _say(stream, json.dumps({"error": error}, indent=1))


def _as_told(error: BaseException) -> BakeError:
    """``error`` as the user is told of it."""
    error = out_of_memory(error) or error
    if isinstance(error, OSError) and error.errno is not None:
        error = disk_error(error.filename or "a file", error, doing="use")
    elif not isinstance(error, BakeError):
        where = traceback.extract_tb(error.__traceback__)[-1]
        error = BakeError(f"internal error, {type(error).__name__}: {error} ({where.name}, line {where.lineno})",
                          "please report it with the output of --traceback")
    return error
