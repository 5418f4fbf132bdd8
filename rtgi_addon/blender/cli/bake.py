"""`bake`: every Light Probe Volume of the file into a bundle."""

import argparse
import re
from dataclasses import dataclass

from ... import techniques
from ...errors import UsageError
from ...exchange.bundle import check_target, read_bundle
from ...jobs.bake import bake_scene, check_picture, require_device
from ...jobs.plan import USUAL, PlannedBake, bake_fitted, bake_planned
from ...jobs.prepared_bake import bake_prepared
from ...jobs.report import BakeSummary
from ...jobs.series import bake_series, check_series_target
from ...jobs.verify import VerifyReport
from ...storage.paths import require_suffix
from .base import EXTRACT_SHARE, Report, Session, Subcommand
from .options import (
    PLANNED,
    add_placement,
    add_technique,
    atlas_settings,
    check_technique,
    is_beside,
    overrides,
    scatter_settings,
    sphere_settings,
)
from .part import LAST_FRAME, add_part
from .plan import add_strict, add_target, strictly, target_of
from .verify import add_places, verify_with_cycles

# How far a bake that is verified is when that begins.
_VERIFY_FROM = 0.7


@dataclass(frozen=True)
class VerifiedBake:
    """A finished bake, and how far it is from Cycles."""

    bake: BakeSummary | PlannedBake
    report: VerifyReport

    @property
    def refusal(self):
        """See Report: a bake that differs has failed, though it is written."""
        return self.report.refusal

    def to_json(self) -> dict:
        """The bake's values, with the verification's beside them."""
        return {**self.bake.to_json(), "verified": self.report.to_json()}

    def to_text(self) -> str:
        """The bake's lines, then the verification's."""
        return f"{self.bake.to_text()}\n{self.report.to_text()}"


# Options that a prepared bake leaves open; all others were decided when it was prepared.
_STILL_OPEN = {"subcommand", "prepared", "part", "out", "resume", "checkpoint_seconds", "threads", "json", "traceback"}


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("prepared", nargs="?", metavar="PREP", help="the folder that `prepare --out` wrote, in place of a FILE")
    parser.add_argument("--part", type=_part, metavar="K/N", help="bake only the K-th of N parts of a PREP, for `merge`")
    parser.add_argument("--out", required=True, metavar="DIR", help="the bundle to write; an earlier one is replaced at the end")
    add_technique(parser, planned=True)
    add_placement(parser)
    parser.add_argument("--resume", action="store_true", help="continue an interrupted bake to the same --out")
    parser.add_argument("--checkpoint-seconds", type=_seconds, default=10.0, metavar="T",
                        help="how often an unfinished bake is saved (default 10)")
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu",
                        help="where the inner loops of a technique run that knows both (default cpu)")
    parser.add_argument("--frames", type=_frames, metavar="A-B[:STEP]",
                        help="a series: one bundle in --out for each of these frames, and an index; frames alike share one")
    parser.add_argument("--picture", metavar="FILE.png", help="then draw the probes as spheres in the scene they light")
    verified = parser.add_argument_group("with --verify")
    verified.add_argument("--verify", action="store_true", help="then hold what was read, and the bake, to Cycles at a few places")
    add_places(verified)
    planned = parser.add_argument_group(f"with --technique {PLANNED}")
    add_target(planned)
    add_strict(planned, "; the bundle is written all the same")
    planned.add_argument("--no-check", action="store_true", help="do not measure how good the plan was after the bake")


def _check(arguments: argparse.Namespace) -> None:
    if arguments.prepared is not None:
        _require_open_options(arguments)
        return
    arguments.left_open = _left_open(arguments)
    arguments.technique = arguments.technique or USUAL
    if arguments.part is not None:
        raise UsageError("--part is of a prepared bake", "prepare it first (`rtgi FILE prepare --out PREP`), and name the PREP")
    if arguments.frames is not None:
        _check_frames(arguments)
    if arguments.picture is not None:
        require_suffix(arguments.picture, (".png",), "--picture")
    sphere_settings(arguments)
    atlas_settings(arguments)
    scattered = scatter_settings(arguments).scatters
    if arguments.technique != PLANNED:
        check_technique(arguments)
        if arguments.memory is not None or arguments.keep_air or arguments.nested or arguments.no_check \
                or arguments.strict:
            raise UsageError("--memory, --keep-air, --nested, --no-check and --strict are for a plan", f"add --technique {PLANNED}")
        return
    if scattered:
        raise UsageError("a plan is of lattices, and chooses how fine they are", "leave out --placement, or name a technique")
    if arguments.device != "cpu":
        raise UsageError("a planned bake runs on the CPU", "leave out --device, or name a technique")
    if arguments.strict and arguments.verify:
        raise UsageError("--verify and --strict both decide the exit code", "leave out one of them")
    chosen = [name for name in ("rays", "bounces", "preset") if getattr(arguments, name) is not None]
    chosen += [name for name, _ in arguments.assignments if not is_beside(name, arguments)]
    if chosen:
        raise UsageError(f"--technique {PLANNED} chooses {chosen[0]} itself", "leave it out, or name a technique")
    target_of(arguments)


def _left_open(arguments: argparse.Namespace) -> bool:
    """Whether nothing says how to bake, so that a file without a volume gets one that is planned."""
    return arguments.technique is None and arguments.preset is None and arguments.device == "cpu" and arguments.frames is None \
        and not overrides(arguments) and not scatter_settings(arguments).scatters


def _require_open_options(arguments: argparse.Namespace) -> None:
    parser = argparse.ArgumentParser(add_help=False)
    _add_arguments(parser)
    add_part(parser)
    usual = vars(parser.parse_args(["--out", arguments.out]))
    given = [name for name, value in vars(arguments).items() if name not in _STILL_OPEN and value != usual.get(name)]
    if given:
        option = next(action.option_strings[0] for action in parser._actions if action.dest == given[0])
        raise UsageError(f"{option} was decided when {arguments.prepared} was prepared", "leave it out, or prepare the bake again")


def _run(arguments: argparse.Namespace, session: Session) -> Report:
    if arguments.prepared is not None:
        return bake_prepared(arguments.prepared, arguments.out, part=arguments.part, threads=arguments.threads,
                             progress=session.progress, resume=arguments.resume, checkpoint_seconds=arguments.checkpoint_seconds)
    from ..motion import find_motion  # needs Blender, which prints when it is loaded
    # Everything that can fail without the file fails before it is read.
    if arguments.technique != PLANNED:
        require_device(techniques.get(arguments.technique), arguments.device)
    if arguments.frames is not None:
        return _bake_series(arguments, session)
    target = check_target(arguments.out, inputs=session.inputs)
    if arguments.picture is not None:
        check_picture(arguments.picture, target, session.inputs)
    if arguments.device == "gpu":
        from ..gpu_context import open_context
        open_context()
    session.progress.stage("extract")
    scene = session.read_scene()
    progress = session.progress.span(EXTRACT_SHARE, _VERIFY_FROM if arguments.verify else 1.0)
    if arguments.left_open and all(volume.fitted for volume in scene.volumes):
        done = bake_fitted(
            scene, arguments.out, seed=arguments.seed, threads=arguments.threads, motion=find_motion(), resume=arguments.resume,
            checkpoint_seconds=arguments.checkpoint_seconds, picture=arguments.picture, progress=progress,
            spheres=sphere_settings(arguments), atlas=atlas_settings(arguments))
    elif arguments.technique == PLANNED:
        done = bake_planned(
            scene, target_of(arguments), arguments.out, seed=arguments.seed, threads=arguments.threads, volume=arguments.volume,
            motion=find_motion(), check=not arguments.no_check, direct=bool(arguments.direct), resume=arguments.resume,
            checkpoint_seconds=arguments.checkpoint_seconds, picture=arguments.picture, progress=progress,
            spheres=sphere_settings(arguments), atlas=atlas_settings(arguments))
    else:
        done = bake_scene(
            scene, arguments.technique, overrides(arguments), arguments.out, seed=arguments.seed, threads=arguments.threads,
            progress=progress, resume=arguments.resume, volume=arguments.volume, checkpoint_seconds=arguments.checkpoint_seconds,
            device=arguments.device, picture=arguments.picture, spheres=sphere_settings(arguments), atlas=atlas_settings(arguments),
            placement=scatter_settings(arguments))
    if not arguments.verify:
        return strictly(done, done.plan, arguments) if isinstance(done, PlannedBake) else done
    told = (done.bake if isinstance(done, PlannedBake) else done).not_followed
    return VerifiedBake(done, verify_with_cycles(scene, read_bundle(arguments.out).field, arguments,
                                                 session.progress.span(_VERIFY_FROM, 1.0), not_followed=told))


def _check_frames(arguments: argparse.Namespace) -> None:
    for name, given in (("--frame", arguments.frame is not None), ("--picture", arguments.picture is not None),
                        ("--verify", arguments.verify), (f"--technique {PLANNED}", arguments.technique == PLANNED)):
        if given:
            raise UsageError(f"{name} is about one frame, and --frames bakes several", "leave out one of them")


def _bake_series(arguments: argparse.Namespace, session: Session) -> Report:
    check_series_target(arguments.out, session.inputs)
    if arguments.device == "gpu":
        from ..gpu_context import open_context
        open_context()
    from ..frames import frames_per_second
    session.progress.stage("extract")
    return bake_series(
        session.read_frame, arguments.frames, arguments.technique, overrides(arguments), arguments.out,
        frames_per_second=frames_per_second, seed=arguments.seed, threads=arguments.threads, resume=arguments.resume,
        volume=arguments.volume, checkpoint_seconds=arguments.checkpoint_seconds, device=arguments.device,
        spheres=sphere_settings(arguments), atlas=atlas_settings(arguments), placement=scatter_settings(arguments),
        inputs=session.inputs, progress=session.progress)


def _frames(text: str) -> range:
    """A type of argument: A-B or A-B:STEP, of which A and B may be negative."""
    match = re.fullmatch(r"(-?\d{1,7})-(-?\d{1,7})(?::(\d{1,7}))?", text)
    first, last, step = (1, 0, 1) if match is None else (int(match[1]), int(match[2]), int(match[3] or 1))
    if last < first or step < 1 or max(abs(first), abs(last)) > LAST_FRAME:
        raise argparse.ArgumentTypeError(f"{text!r} is not frames A-B, or A-B:STEP")
    return range(first, last + 1, step)


def _part(text: str) -> tuple[int, int]:
    part, slash, parts = text.partition("/")
    if not (slash and part.isascii() and part.isdigit() and parts.isascii() and parts.isdigit() and 1 <= int(part) <= int(parts)):
        raise argparse.ArgumentTypeError(f"{text!r} is not K/N, the K-th of N parts")
    return int(part), int(parts)


def _seconds(text: str) -> float:
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number of seconds")
    return value


SUBCOMMAND = Subcommand("bake", "bake every Light Probe Volume into a bundle", True, _add_arguments, _run, _check)
