"""Coarser lattices whose probes are fitted to surfaces: as right as those of a finer one as they are measured.

What a fit brings differs from scene to scene and from spacing to spacing: on two rooms it left 0.53 to 0.66 of the error of
lattices of 60 to 1,000 probes, and all of it at 2,000 to 5,000. So it is not foretold. The lattice is baked and fitted, and held
to receivers that the fit did not see; the bake that is planned in the end is the one that was tried, and is not made again.
Volumes within others become coarser as those do: which box each of them is stays what it was planned as.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ... import techniques
from ...progress import Progress
from ...scene import ProbeVolume
from ...techniques.probes.settings import ProbeSettings
from ...techniques.probes.started import Finished
from ...transport.rays.ray_counter import count_rays
from ..metrics import Figure
from .pilot import CACHE_SHARE, Pilot, Reading
from .search import GREATEST_RATE, LEAST_RATE, OVERSHOOT, USUAL_RATE, Found
from .tries import NO_STEP, upper

# What a fit is thought to leave of the error where nothing was tried yet: it only says which lattice is tried first.
USUALLY_LEFT = 0.7
# Lattices that are baked and fitted at the most, besides the one that does without a fit.
TRIES = 2
# The stage of a bake that is its fit.
_FIT = "fit"


def fit_lattice(pilot: Pilot, found: Found, target: float, planned: Callable[[Reading], tuple[ProbeVolume, ...]],
                progress: Progress) -> Found:
    """``found``, or a coarser lattice whose fitted probes are within ``target`` (and if none is, ``found`` fitted): with the error
    that fitted probes have, and the bake that was made of them left to the ``pilot``. ``planned(reading)`` are the volumes as they
    would be planned. Raises Cancelled."""
    rate = float(np.clip(USUAL_RATE if found.rate is None else found.rate, LEAST_RATE, GREATEST_RATE))
    whole, factor, too_coarse = found.reading, 1.0, 0.0
    following = OVERSHOOT * (USUALLY_LEFT * upper(found.error) / target) ** (1.0 / rate)
    best, tried_already = None, {whole.resolutions}
    for number in range(TRIES):
        if not too_coarse < following <= NO_STEP * factor:
            break
        volumes = _coarser(whole.volumes, following)
        resolutions = tuple(tuple(volume.resolution) for volume in volumes)
        if resolutions in tried_already:
            break
        span = progress.span(number / (TRIES + 1), (number + 1) / (TRIES + 1))
        tried_already.add(resolutions)
        tried = _tried(pilot, pilot.measure_volumes(volumes, span, 0), found, planned, span)
        ratio = OVERSHOOT * (upper(tried.error) / target) ** (1.0 / rate)
        if upper(tried.error) <= target:
            best, factor = tried, following
        else:
            too_coarse = following
        following *= ratio
    if best is None:
        best = _tried(pilot, whole, found, planned, progress.span(TRIES / (TRIES + 1), 1.0))
    pilot.finished = best.finished
    return replace(best, met=upper(best.error) <= target, measured=whole)


def _coarser(volumes: tuple[ProbeVolume, ...], factor: float) -> tuple[ProbeVolume, ...]:
    return tuple(replace(volume, resolution=tuple(max(min(2, count), round(count * factor)) for count in volume.resolution))
                 for volume in volumes)


def _tried(pilot: Pilot, reading: Reading, found: Found, planned, progress: Progress) -> Found:
    """``found`` with the lattices of ``reading``, baked and fitted, and the error of that."""
    settings = ProbeSettings(order=found.order, error=found.ray_error, fit=True)
    scene = replace(pilot.context.scene, volumes=planned(reading))
    own = progress.apart()
    with count_rays() as counter:
        field = techniques.get("probes").bake(scene, settings, np.random.default_rng(pilot.seed), own,
                                              threads=pilot.context.threads, begun=pilot.begun)
    stages = own.finish()
    fit_seconds = stages.pop(_FIT, 0.0)
    # Those by which the lattice that does without was decided upon: others may be harder.
    receivers = pilot.sample.receivers.take(slice(0, len(found.reading.variance)))
    figure = pilot.sample.error(field.irradiance(receivers.points, receivers.normals), pilot.truth)
    value = float(np.hypot(figure.value, CACHE_SHARE * found.ray_error))
    error = Figure(value, figure.standard_error * (figure.value / value if value > 0 else 1.0))
    finished = Finished(scene.volumes, settings, pilot.bake_seed, field, sum(stages.values()), counter.rays, fit_seconds)
    return replace(found, reading=reading, error=error, fitted=True, finished=finished)
