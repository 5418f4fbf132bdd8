"""`relight`: a bundle with transfer under other light, from its files alone."""

import argparse
import re

from ...errors import UsageError
from ...exchange.sky_image import SUFFIXES
from ...jobs.relight import LightChange, RelightReport, parse_numbers, relight_bundle, require_at_least_zero
from .base import Session, Subcommand

_WORLD, _SUN = "IMAGE|R,G,B", "AZIMUTH,ELEVATION,STRENGTH[,R,G,B]"
_GROUP, _LAMP = "NAME=FACTOR|R,G,B", "X,Y,Z,WATTS"


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    # Values may begin with a minus, as in `--lamp -1,2,1.5,60`; no option is a number.
    parser._negative_number_matcher = re.compile(r"^-[\d.]")
    parser.add_argument("bundle", metavar="BUNDLE", help="the folder that `bake --technique transfer --out` wrote")
    parser.add_argument("--out", required=True, metavar="DIR", help="the bundle to write, or with --frames the folder of bundles")
    parser.add_argument("--world", metavar=_WORLD, help=f"another world: an equirectangular image ({', '.join(SUFFIXES)}), or one "
                                                        "radiance [W/(sr m²)]")
    parser.add_argument("--sky-turn", type=float, metavar="DEGREES", help="turn the world about +Z, counterclockwise from above")
    parser.add_argument("--sun", action="append", metavar=_SUN, dest="suns",
                        help="a sun: degrees from +Y (north) towards +X (east), degrees above the horizon, strength as Blender's "
                             "[W/m²]; the first replaces the file's suns, and may be repeated")
    parser.add_argument("--group", action="append", default=[], metavar=_GROUP, dest="groups",
                        help="dim, brighten or colour a group of lights; may be repeated")
    parser.add_argument("--lamp", action="append", default=[], metavar=_LAMP, dest="lamps",
                        help="one more lamp, by the nearest of the bake's lamp sites; may be repeated")
    parser.add_argument("--frames", metavar="FILE.json", help="a series: one bundle in --out for each of the file's frames")


def _change(arguments: argparse.Namespace) -> LightChange:
    """What the options say. Raises UsageError."""
    world = arguments.world
    if world is not None and not world.lower().endswith(SUFFIXES) and re.fullmatch(r"[-+.,\deE\s]+", world):
        world = parse_numbers(world, (3,), f"a world, {_WORLD}")
        require_at_least_zero(world, arguments.world, f"a world, {_WORLD}")
    suns = None if arguments.suns is None else tuple(parse_numbers(words, (3, 6), f"a sun, {_SUN}") for words in arguments.suns)
    for sun, words in zip(suns or (), arguments.suns or (), strict=True):
        require_at_least_zero(sun[2:], words, f"a sun, {_SUN}")
        if not -90.0 <= sun[1] <= 90.0:
            raise UsageError(f"the sun {words} stands {sun[1]:g}° above the horizon", "give an elevation from -90 to 90")
    groups = {}
    for words in arguments.groups:
        name, equals, factor = words.rpartition("=")
        if not equals or not name:
            raise UsageError(f"{words!r} is not {_GROUP}", "name a group and a factor")
        values = parse_numbers(factor, (1, 3), f"a factor of a group, {_GROUP}")
        require_at_least_zero(values, words, f"a factor of a group, {_GROUP}")
        groups[name] = values * 3 if len(values) == 1 else values
    lamps = tuple(parse_numbers(words, (4,), f"a lamp, {_LAMP}") for words in arguments.lamps)
    for lamp, words in zip(lamps, arguments.lamps, strict=True):
        require_at_least_zero(lamp[3:], words, f"a lamp, {_LAMP}")
    return LightChange(world, arguments.sky_turn, suns, groups, lamps)


def _check(arguments: argparse.Namespace) -> None:
    _change(arguments)
    if arguments.sky_turn is not None and not abs(arguments.sky_turn) < 1e6:
        raise UsageError(f"--sky-turn is {arguments.sky_turn:g}", "give degrees")


def _run(arguments: argparse.Namespace, session: Session) -> RelightReport:
    return relight_bundle(arguments.bundle, arguments.out, _change(arguments), arguments.frames, session.progress)


SUBCOMMAND = Subcommand("relight", "relight a bundle with transfer, from its files alone", False, _add_arguments, _run, _check)
