"""Why a plan is what it is, in plain sentences."""

import numpy as np

from ...scene import ProbeVolume
from .look import Look, sentences
from .pilot import WORST as WORST_POINTS
from .search import Found
from .tries import CONFIDENCE, upper

# Errors that differ by less than this share of their own standard error are alike.
ALIKE = 1.0
# The share of the surface that a plan out of reach names the error of.
WORST = 0.01
# Errors from here on are said without digits after the point.
_LARGE = 0.0995
# The finest lattices of the climb that a sentence lists.
_SHOWN_STEPS = 4


def reasons(look: Look, found: Found, chosen, files: tuple[ProbeVolume, ...], volumes: tuple[ProbeVolume, ...], target,
            kept: int) -> list[str]:
    """Sentences about the scene (``look``), the lattice, order and rays that were ``found``, what was ``chosen`` (an Option) for
    the ``target``, and the lattice points that are ``kept``; ``files`` are the volumes before."""
    lines = sentences(look)
    lines.append(_climb(found))
    lines += _lattices(files, [volume for volume in volumes if not volume.planned], found.single is not None)
    lines += _nesting(found, volumes)
    lines += _fit(found)
    lines.append(_verdict(found, chosen, target))
    if not chosen.meets:
        lines.append(_worst(found))
    if chosen.technique != "probes":
        lines.append(f"At this error {chosen.technique} is cheaper than exact probes.")
        return lines
    lines.append(_order(found))
    lines.append(f"Rays stop once a probe's own light is known to {percent(found.ray_error)}, which costs less than a finer "
                 "lattice would. Light is followed until it has died away, since further bounces take no rays.")
    probes = found.reading.lattice_points
    if kept < probes:
        lines.append(f"{probes - kept:,} of {probes:,} probes get no rays, since no surface reads them: in the bundle their "
                     "validity is 0 and they hold their neighbours' light.")
    return lines


def percent(value: float) -> str:
    """An error for a person: two digits, no more than two after the point."""
    if not np.isfinite(value):
        return "unknown"
    return f"{100 * value:.0f} %" if value >= _LARGE else f"{100 * value:.2g} %"


def size(resolutions) -> str:
    """Resolutions for a person."""
    return ", ".join(" x ".join(map(str, resolution)) for resolution in resolutions)


def _climb(found: Found) -> str:
    order = found.order
    steps = [f"{percent(reading.error(order).value)} at {size(reading.resolutions)}" for reading in found.climb]
    text = "The lattice alone is off by " + ", ".join(steps[-_SHOWN_STEPS:])
    if found.rate is None or found.rate <= 0.0:
        return text + "."
    return text + f": the error falls like the spacing to the power {found.rate:.1f}."


def _lattices(files, volumes, nested: bool) -> list[str]:
    lines = []
    for before, after in zip(files, volumes, strict=True):
        old, new = tuple(before.resolution), tuple(after.resolution)
        if old == new:
            lines.append(f"{after.name!r} keeps its {size([new])} probes.")
            continue
        ratio = np.array(new) / np.array(old)
        how = "coarser, but for finer volumes within" if nested and ratio.max() <= 1.0 else \
            "finer" if ratio.min() >= 1.0 else "coarser, since light is smooth there" if ratio.max() <= 1.0 else \
            "finer where light changes, coarser along the axes where it is smooth"
        lines.append(f"{after.name!r} goes from {size([old])} to {size([new])} probes: {how}.")
    return lines


def _nesting(found: Found, volumes) -> list[str]:
    if found.nesting == "spread":
        return ["Finer volumes within coarser ones were tried, and save too few probes: the error is spread over the surfaces."]
    lines = [f"{volume.name!r}, {size([volume.resolution])} probes within {volume.planned!r}, lies where most of the error was."
             for volume in volumes if volume.planned]
    if found.single is not None:
        nested = found.measured or found.reading
        lines.append(f"Nested so, {nested.lattice_points:,} probes do what takes {found.single.lattice_points:,} without.")
    return lines


def _fit(found: Found) -> list[str]:
    if not found.fitted:
        return []
    probes, other = found.reading.lattice_points, found.measured.lattice_points
    if probes < other:
        return [f"Fitted to surfaces, {probes:,} probes do what takes {other:,} as they are measured: a bake of them was held to "
                "points that its fit did not see."]
    return ["Fitted to surfaces, no coarser lattice that was tried does: a bake of each was held to points that its fit did not "
            "see."]


def _verdict(found: Found, chosen, target) -> str:
    bound = upper(chosen.error)
    if chosen.meets:
        return (f"{percent(target.error)} at surfaces is met by {chosen.technique}: {percent(chosen.error.value)} is predicted, "
                f"and less than {percent(bound)} with {100 * CONFIDENCE:.0f} % confidence.")
    if found.limited == "convergence":
        why = "finer lattices hardly improve it: light changes over less than any sane spacing, or leaks past geometry"
    elif found.limited == "effort":
        why = "finer lattices improve it too slowly for what they take"
    elif found.limited:
        why = f"the {found.limited} allows no finer lattice"
    else:
        why = "no ray setting brings it down"
    bulk = found.reading.bulk(found.order, found.ray_error)
    line = (f"{percent(target.error)} at surfaces cannot be met: {why}. What is planned is what is worth its rays: "
            f"{percent(chosen.error.value)}, and {percent(bulk)} without the worst {percent(WORST_POINTS)} of the points.")
    finest = max(found.climb, key=lambda reading: reading.lattice_points)
    if finest.lattice_points <= found.reading.lattice_points:
        return line
    more = finest.lattice_points / found.reading.lattice_points
    return line + (f" The finest that was tried, {size(finest.resolutions)}, is off by "
                   f"{percent(finest.error(found.order).value)} and has {more:.2g} times the probes.")


def _worst(found: Found) -> str:
    pilot, order = found.reading.pilot, found.order
    share = pilot.sample.concentration(found.reading.estimate(order), pilot.truth, WORST)
    return f"{percent(share)} of the squared error lies on the worst {percent(WORST)} of the surface."


def _order(found: Found) -> str:
    errors = {order: found.reading.error(order) for order in found.reading.pilot.orders}
    others = [order for order in errors if order != found.order]
    if not others:
        return f"SH of order {found.order}, as asked."
    other, chosen = others[-1], errors[found.order]
    both = f"the lattice is off by {percent(chosen.value)} with it and by {percent(errors[other].value)} with order {other}"
    if found.order > other:
        return f"SH of order {found.order}: {both}, which would have to be finer."
    alike = chosen.value - errors[other].value <= ALIKE * chosen.standard_error
    verdict = "which adds less than can be told from noise" if alike else "which is more than is asked for"
    return f"SH of order {found.order}, {(found.order + 1) ** 2} numbers a channel: {both}, {verdict}."
