"""What the other techniques would do: each is baked on a coarse lattice, and its own light is held to the pilot's receivers."""

from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np

from ... import techniques
from ...errors import BakeError
from ...progress import Progress
from ...techniques import Technique
from ...transport.rays.ray_counter import count_rays
from ..metrics import Figure
from .pilot import Pilot
from .sample import NORMALS_PER_POINT

# Surface points that other techniques are looked up at, and probes of the two lattices that tell what a probe of theirs costs.
POINTS, FEW, MORE = 64, 8, 64
# Other techniques are weighed by `bake --technique auto` only at targets so loose that one of them may meet them: what they keep of
# the light is off by more than this on every scene measured (benchmarks/README.md), or takes more rays a probe than probes do.
LOOSE = 0.15


@dataclass(frozen=True)
class Measured:
    """A technique at its defaults. ``error`` of its own light at receivers; what a bake of n probes costs is ``rays`` +
    n * ``rays_per_probe``, and alike in ``seconds``. ``why_not`` says why it could not be baked, if it could not."""

    technique: str
    label: str
    error: Figure = field(default_factory=lambda: Figure(np.inf, np.nan))
    rays: float = 0.0
    rays_per_probe: float = 0.0
    seconds: float = 0.0
    seconds_per_probe: float = 0.0
    why_not: str = ""


def measure_others(pilot: Pilot, names: list[str], seed: int, progress: Progress) -> list[Measured]:
    """The techniques ``names``, one after another. Raises Cancelled."""
    measured = []
    for number, name in enumerate(names):
        progress.step(number / len(names), f"measuring {name}")
        method = techniques.get(name)
        if method.not_weighed:
            measured.append(Measured(name, method.label, why_not=method.not_weighed))
            continue
        try:
            measured.append(_measure(pilot, method, seed, progress.span(number / len(names), (number + 1) / len(names))))
        except BakeError as error:
            measured.append(Measured(name, method.label, why_not=error.cause))
    return measured


def _measure(pilot: Pilot, method: Technique, seed: int, progress: Progress) -> Measured:
    points = []
    for probes in (FEW, MORE):
        volumes = tuple(replace(volume, resolution=_coarse(volume.resolution, probes)) for volume in pilot.volumes)
        scene = replace(pilot.context.scene, volumes=volumes)
        with count_rays() as counter:
            started = perf_counter()
            baked = method.bake(scene, method.Settings(), np.random.default_rng(seed), progress, threads=pilot.context.threads)
            baked.grids()
            points.append((sum(float(np.prod(volume.resolution)) for volume in volumes), counter.rays, perf_counter() - started))
    (few, first_rays, first_seconds), (more, rays, seconds) = points
    per_probe = [max(dear - cheap, 0.0) / max(more - few, 1.0) for cheap, dear in ((first_rays, rays), (first_seconds, seconds))]
    count = min(POINTS, pilot.sample.points) * NORMALS_PER_POINT
    receivers = pilot.sample.receivers.take(slice(0, count))
    error = pilot.sample.error(baked.irradiance(receivers.points, receivers.normals), pilot.truth)
    return Measured(method.name, method.label, error,
                    max(rays - more * per_probe[0], 0.0), per_probe[0], max(seconds - more * per_probe[1], 0.0), per_probe[1])


def _coarse(resolution: tuple[int, int, int], probes: int) -> tuple[int, int, int]:
    """A lattice of about ``probes`` probes in the proportions of ``resolution``, two along each axis that has several."""
    factor = (probes / np.prod(resolution)) ** (1.0 / 3.0)
    return tuple(max(min(2, count), round(count * factor)) for count in resolution)
