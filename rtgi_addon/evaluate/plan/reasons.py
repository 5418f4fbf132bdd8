"""Why a plan is what it is, in plain sentences."""

import numpy as np

from ...scene import ProbeVolume
from .look import Look, sentences
from .search import CONFIDENCE, Found, upper

# Errors that differ by less than this share of their own standard error are alike.
ALIKE = 1.0
# The share of the surface that a plan out of reach names the error of.
WORST = 0.01


def reasons(look: Look, found: Found, chosen, files: tuple[ProbeVolume, ...], volumes: tuple[ProbeVolume, ...], target,
            kept: int) -> list[str]:
    """Sentences about the scene (``look``), the lattice, order and rays that were ``found``, what was ``chosen`` (an Option) for
    the ``target``, and the lattice points that are ``kept``; ``files`` are the volumes before."""
    lines = sentences(look)
    lines.append(_climb(found))
    lines += _lattices(files, volumes)
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
    return f"{100 * value:.0f} %" if value >= 0.0995 else f"{100 * value:.2g} %"


def size(resolutions) -> str:
    """Resolutions for a person."""
    return ", ".join(" x ".join(map(str, resolution)) for resolution in resolutions)


def _climb(found: Found) -> str:
    order = found.order
    steps = [f"{percent(reading.error(order).value)} at {size(reading.resolutions)}" for reading in found.climb]
    text = "The lattice alone is off by " + ", ".join(steps[-4:])
    if found.rate is None or found.rate <= 0.0:
        return text + "."
    return text + f": the error falls like the spacing to the power {found.rate:.1f}."


def _lattices(files, volumes) -> list[str]:
    lines = []
    for before, after in zip(files, volumes, strict=True):
        old, new = tuple(before.resolution), tuple(after.resolution)
        if old == new:
            lines.append(f"{after.name!r} keeps its {size([new])} probes.")
            continue
        ratio = np.array(new) / np.array(old)
        how = "finer" if ratio.min() >= 1.0 else "coarser, since light is smooth there" if ratio.max() <= 1.0 else \
            "finer where light changes, coarser along the axes where it is smooth"
        lines.append(f"{after.name!r} goes from {size([old])} to {size([new])} probes: {how}.")
    return lines


def _verdict(found: Found, chosen, target) -> str:
    bound = upper(chosen.error)
    if chosen.meets:
        return (f"{percent(target.error)} at surfaces is met by {chosen.technique}: {percent(chosen.error.value)} is predicted, "
                f"and less than {percent(bound)} with {100 * CONFIDENCE:.0f} % confidence.")
    if found.limited == "convergence":
        why = "finer lattices hardly improve it: light changes over less than any sane spacing, or leaks past geometry"
    elif found.limited:
        why = f"the {found.limited} allows no finer lattice"
    else:
        why = "no ray setting brings it down"
    return (f"{percent(target.error)} at surfaces cannot be met: {why}. What is planned is the cheapest that comes near the best "
            f"there is, {percent(chosen.error.value)}.")


def _worst(found: Found) -> str:
    pilot, order = found.reading.pilot, found.order
    share = pilot.sample.concentration(found.reading.estimate(order), pilot.truth, WORST)
    return f"{percent(share)} of the squared error lies on the worst {percent(WORST)} of the surface."


def _order(found: Found) -> str:
    errors = {order: found.reading.error(order) for order in found.reading.pilot.orders}
    others = [order for order in errors if order != found.order]
    if not others:
        return f"SH of order {found.order}, as asked."
    other, own = others[-1], errors[found.order]
    both = f"the lattice is off by {percent(own.value)} with it and by {percent(errors[other].value)} with order {other}"
    if found.order > other:
        return f"SH of order {found.order}: {both}, which would have to be finer."
    alike = own.value - errors[other].value <= ALIKE * own.standard_error
    verdict = "which adds less than can be told from noise" if alike else "which is more than is asked for"
    return f"SH of order {found.order}, {(found.order + 1) ** 2} numbers a channel: {both}, {verdict}."
