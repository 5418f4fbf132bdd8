"""Where a field has light that should not be there, and why: every receiver's excess over the path reference, with a named cause.

A receiver leaks when it gets more than ``EXCESS`` of its true light and ``LEVEL`` of the scene's mean on top of the truth, and more
than the reference's noise explains. What is to blame the field itself knows (``Field.leak_causes``).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import BakeError
from ..progress import Progress
from ..techniques import Cause, Field
from ..techniques.lattice.focus import probes_of
from ..transport.context import LightContext
from ..transport.vectors import luminance
from .metrics import signed_error
from .receivers import Receivers, open_probes, surface_receivers
from .references import PathReference, Truth

# What a receiver must get too much to leak: see above; SIGMAS standard errors of the reference are more than its noise explains.
EXCESS, LEVEL, SIGMAS = 0.25, 0.05, 3.0
# Noise of the reference, and the most paths of all receivers together.
NOISE, MOST_PATHS = 0.03, 1 << 23
# How many receivers tell the typical distance from one to the next, and what a lone one stands for [m].
_TELLING, _LONE_RADIUS = 256, 0.1
# A receiver stands for what lies within so many of its radii.
_NEAR = 4.0
# How far the search is when receivers are chosen, and when the truth is known.
_CHOSEN, _KNOWN = 0.02, 0.9


@dataclass(frozen=True, eq=False)
class LeakMap:
    """``found`` and ``truth.mean`` (n, 3) irradiance at ``receivers`` [W/m2]; ``cause`` (n,) int8 of Cause."""

    receivers: Receivers
    found: np.ndarray
    truth: Truth
    cause: np.ndarray

    @cached_property
    def error(self) -> np.ndarray:
        """Signed error (n,) float32 of luminance: positive is too bright."""
        return signed_error(luminance(self.found), luminance(self.truth.mean)).astype(np.float32)

    @cached_property
    def radius(self) -> float:
        """Half the typical distance [m] from a receiver to the next: what each stands for on its surface."""
        points = self.receivers.points
        if len(points) < 2:
            return _LONE_RADIUS
        telling = points[np.linspace(0, len(points) - 1, min(len(points), _TELLING)).astype(int)]
        squares = np.square(telling[:, None] - points[None]).sum(axis=2)
        return 0.5 * float(np.sqrt(np.partition(squares, 1, axis=1)[:, 1].mean()))

    def counts(self) -> dict[Cause, int]:
        """Receivers by cause, most first, only those that leak."""
        causes, counts = np.unique(self.cause[self.cause != Cause.NONE], return_counts=True)
        return {Cause(causes[index]): int(counts[index]) for index in np.argsort(-counts, kind="stable")}

    def lines(self) -> list[str]:
        """For a panel: how many leak, then a line a cause."""
        counts = self.counts()
        head = f"{sum(counts.values()):,} of {len(self.cause):,} receivers leak"
        return [head, *(f"{count:,}: {cause.text}" for cause, count in counts.items())]

    def nearest(self, point: np.ndarray) -> int | None:
        """The receiver that stands for ``point`` (3,) on a surface, or None if none is near."""
        if not len(self.receivers.points):
            return None
        distance = np.linalg.norm(self.receivers.points - np.asarray(point, np.float32), axis=1)
        row = int(distance.argmin())
        return row if distance[row] <= _NEAR * self.radius else None


def find_leaks(context: LightContext, field: Field, points: int = 2000, seed: int = 0, progress: Progress | None = None) -> LeakMap:
    """Compare ``field`` with the path reference at ``points`` points of surfaces around the scene's volumes. Raises Cancelled,
    BakeError where a volume captures other light than there is."""
    progress = progress or Progress()
    progress.step(0.0, "Choosing receivers")
    volumes = context.scene.volumes
    other = next((volume for volume in volumes if not volume.captures_all), None)
    if other is not None:
        raise BakeError(f"leaks are found by comparison with all light as it is, and volume {other.name} captures other light",
                        "set its Intensity to 1, let it capture indirect light and emission, and bake again")
    receivers = surface_receivers(context, probes_of(volumes)[open_probes(context, volumes)], points, 1, seed)
    truth = PathReference(context, NOISE, MOST_PATHS, seed + 1).irradiance(receivers, progress.span(_CHOSEN, _KNOWN))
    progress.step(_KNOWN, "Naming causes")
    found = np.asarray(field.irradiance(receivers.points, receivers.normals), np.float64)
    cause = name_causes(context, field, receivers, found, truth)
    progress.step(1.0, "Done")
    return LeakMap(receivers, found, truth, cause)


def name_causes(context: LightContext, field: Field, receivers: Receivers, found: np.ndarray, truth: Truth) -> np.ndarray:
    """(n,) int8 of Cause for what a field says (``found``, (n, 3)) at ``receivers`` and the ``truth``."""
    true, noise = luminance(truth.mean), np.sqrt(luminance(truth.variance))
    excess = luminance(found) - true
    rows = np.flatnonzero(excess > np.maximum(np.maximum(EXCESS * true, LEVEL * float(true.mean())), SIGMAS * noise))
    cause = np.zeros(len(found), np.int8)
    if len(rows) == 0:
        return cause
    cause[rows] = field.leak_causes(context, receivers.points[rows], receivers.normals[rows], excess[rows])
    return cause
