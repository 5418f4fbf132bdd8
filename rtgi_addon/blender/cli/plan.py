"""`plan`: the cheapest technique, lattice, order and rays that meet an error at surfaces, and why."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from ...errors import BakeError
from ...evaluate.plan import Plan, Target
from ...evaluate.plan.choice import MOST_PROBES
from ...jobs.plan import plan_scene
from ...storage.paths import check_output, require_suffix
from ...storage.workplace import workplace
from ...storage.writing import claim
from ...words import as_lines
from .base import EXTRACT_SHARE, Report, Session, Subcommand
from .options import at_least

_UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30}


def add_target(parser: argparse.ArgumentParser) -> None:
    """The options that say what a plan has to meet, but for `--error` and `--order`."""
    parser.add_argument("--memory", type=memory, metavar="SIZE", help="that the bake may take, as 512M or 2G (default: any)")
    parser.add_argument("--most-probes", type=at_least(1), default=MOST_PROBES, metavar="N",
                        help=f"that the lattices may have together (default {MOST_PROBES})")
    parser.add_argument("--keep-air", action="store_true",
                        help="keep probes that no surface reads, for things that move through the air")
    parser.add_argument("--nested", action="store_true",
                        help="look for finer volumes within coarser ones, even where that takes longer than it saves")


def add_strict(parser: argparse.ArgumentParser, what: str) -> None:
    """The option that makes a plan which does not meet its error a failure."""
    parser.add_argument("--strict", action="store_true", help=f"exit code 1 where --error is out of reach{what}")


@dataclass(frozen=True)
class Unmet:
    """A report of a ``plan`` that does not meet its error, which has failed for that (`--strict`)."""

    report: Report
    plan: Plan

    @property
    def refusal(self) -> BakeError:
        """See Report."""
        return BakeError(f"an error of {self.plan.target.error:g} is out of reach, the best there is has "
                         f"{self.plan.chosen.error.value:.2g}", "ask for less, or allow more memory or probes")

    def to_json(self) -> dict:
        """That of the report."""
        return self.report.to_json()

    def to_text(self) -> str:
        """That of the report."""
        return self.report.to_text()


def strictly(report: Report, plan: Plan, arguments: argparse.Namespace) -> Report:
    """``report`` on ``plan``, a failure where the command line is strict and the error is not met."""
    return Unmet(report, plan) if arguments.strict and not plan.met else report


def target_of(arguments: argparse.Namespace) -> Target:
    """What the command line asks for."""
    error = Target.error if arguments.error is None else arguments.error
    orders = Target.orders if arguments.order is None else (arguments.order,)
    return Target(error, arguments.memory, arguments.most_probes, orders, arguments.keep_air, arguments.nested, bool(arguments.fit))


def memory(text: str) -> float:
    """Bytes from a number with K, M or G behind it; without one it is MiB."""
    unit = _UNITS.get(text[-1:].upper())
    value = float(text[:-1] if unit else text) * (unit or _UNITS["M"])
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a size")
    return value


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--error", type=float, metavar="E", help=f"relative error at surfaces (default {Target.error:g})")
    parser.add_argument("--order", type=at_least(0), metavar="L", help="SH order (default: 1 or 2, whichever is cheaper)")
    add_target(parser)
    parser.add_argument("--fit", action="store_true",
                        help="plan probes that are fitted to how surfaces and moving things read them, as few as that allows")
    add_strict(parser, "")
    parser.add_argument("--volume", action="append", metavar="NAME", help="plan only this volume; may be repeated")
    parser.add_argument("--apply", metavar="FILE.blend", help="also save a copy of the file with the plan written into it")
    parser.add_argument("--probes-only", action="store_true", help="do not measure the other techniques for comparison")
    parser.add_argument("--seed", type=at_least(0), default=0, metavar="S", help="the same seed gives the same plan")
    parser.add_argument("--threads", type=at_least(1), metavar="N", help="default: every core")


@dataclass(frozen=True)
class Applied:
    """The report of a ``plan`` that was written into the ``file``."""

    report: Report
    plan: Plan
    file: Path

    def to_json(self) -> dict:
        """That of the report, and where it was written."""
        return {**self.report.to_json(), "applied": str(self.file)}

    def to_text(self) -> str:
        """That of the report, where it was written, and the options that bake it so here: a file's settings are its panel's."""
        options = " ".join(f"--{name}" if value is True else f"--{name} {value:g}" for name, value in self.plan.settings.items())
        said = f"The plan is written into {self.file}. Its panel bakes it as planned, and so does bake with --technique " \
               f"{self.plan.technique} {options}."
        return f"{self.report.to_text()}\n{as_lines([said])}"


def _applied(report: Report, out: Path) -> Applied:
    """Write the plan of ``report`` into the open scene, and save that as ``out``."""
    import bpy

    from ..apply_plan import apply_plan
    apply_plan(bpy.context.scene, report.plan)
    # It is written in another folder than it will lie in.
    bpy.ops.file.make_paths_absolute()
    with workplace(out, "plan") as place:
        bpy.ops.wm.save_as_mainfile(filepath=str(claim(place.new / out.name)), copy=True, relative_remap=False)
        place.put_file()
    return Applied(report, report.plan, out)


def _check(arguments: argparse.Namespace) -> None:
    if arguments.apply is not None:
        require_suffix(arguments.apply, (".blend",), "--apply")
    target_of(arguments)


def _run(arguments: argparse.Namespace, session: Session) -> Report:
    from ..motion import find_motion  # needs Blender, which prints when it is loaded
    out = None
    if arguments.apply is not None:
        out = check_output(arguments.apply, folder=False, option="--apply", suffixes=(".blend",), inputs=session.inputs)
    session.progress.stage("extract")
    scene = session.read_scene()
    report = plan_scene(scene, target_of(arguments), seed=arguments.seed, threads=arguments.threads, volume=arguments.volume,
                        motion=find_motion(), others=not arguments.probes_only, progress=session.progress.span(EXTRACT_SHARE, 1.0))
    if out is not None:
        report = _applied(report, out)
    return strictly(report, report.plan, arguments)


SUBCOMMAND = Subcommand("plan", "say the cheapest bake that meets an error at surfaces, and why", True, _add_arguments, _run,
                        _check)
