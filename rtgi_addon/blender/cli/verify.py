"""`verify`: a scene as it was read, and a bundle of it, against Cycles at a few probes and surface points."""

import argparse

from ...exchange.bundle import read_bundle
from ...jobs import verify as job
from ...jobs.belonging import require_of_scene
from ...progress import Progress
from ...scene import Scene
from ...techniques import Field
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import above_zero, at_least


def add_places(parser: argparse.ArgumentParser) -> None:
    """Options that say how much is compared."""
    parser.add_argument("--points", type=at_least(1), default=job.POINTS, metavar="N",
                        help=f"surface points that are compared (default {job.POINTS})")
    parser.add_argument("--probes", type=at_least(1), default=job.PROBES, metavar="N",
                        help=f"probes that are compared (default {job.PROBES})")
    parser.add_argument("--samples", type=at_least(1), default=64, metavar="N",
                        help="Cycles' paths from each of 16 texels of a place (default 64)")
    parser.add_argument("--within", type=above_zero, default=job.WITHIN, metavar="E",
                        help=f"relative difference up to which the two agree (default {job.WITHIN:g})")


def verify_with_cycles(scene: Scene, field: Field | None, arguments: argparse.Namespace, progress: Progress, **options):
    """The VerifyReport of ``scene`` and ``field`` as the command line asks for it."""
    from ..cycles.patches import CyclesPatches
    judge = CyclesPatches(scene, arguments.samples, arguments.threads, seed=arguments.seed)
    return job.verify(scene, judge, field, points=arguments.points, probes=arguments.probes, within=arguments.within,
                      seed=arguments.seed, threads=arguments.threads, progress=progress, **options)


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--bundle", metavar="DIR", help="a bake of FILE, whose probes are compared as well")
    add_places(parser)
    parser.add_argument("--most-suspects", type=at_least(0), default=job.MOST_SUSPECTS, metavar="N",
                        help="objects, lamps and materials that are left out or replaced to find who makes a difference "
                             f"(default {job.MOST_SUSPECTS})")
    parser.add_argument("--seed", type=at_least(0), default=0, metavar="S", help="the same seed compares the same places")
    parser.add_argument("--threads", type=at_least(1), metavar="N", help="default: every core")


def _run(arguments: argparse.Namespace, session: Session) -> job.VerifyReport:
    # Everything that can fail without the file fails before it is read.
    field = None if arguments.bundle is None else read_bundle(arguments.bundle).field
    session.progress.stage("extract")
    scene = session.read_scene()
    if arguments.bundle is not None:
        require_of_scene(arguments.bundle, scene)
    return verify_with_cycles(scene, field, arguments, session.progress.span(EXTRACT_SHARE, 1.0),
                              most_suspects=arguments.most_suspects)


SUBCOMMAND = Subcommand("verify", "hold what was read, and a bundle, to Cycles at a few places", True, _add_arguments, _run)
