"""What estimates are held against: irradiance at receivers and SH at probes, with the reference's own variance.

``PathReference`` is this project's path tracer. Anything else that keeps the protocol ``Reference`` can take its place, such as
Cycles (blender/cycles/reference.py).
"""

from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from ..progress import Progress
from ..scene import Scene, World
from ..techniques.base import KNOWN_LIGHT
from ..transport.context import LightContext
from ..transport.paths.reference import Estimate, irradiance_at, probe_sh
from .receivers import Receivers

# Paths a point of the first round, from whose noise the number of all paths follows, and the most paths of all points together:
# about a minute on two cores.
PILOT_PATHS, MOST_PATHS = 512, 1 << 23
# How far a reference is when its first round is traced.
_PILOTED = 0.1


class Truth(NamedTuple):
    """A reference: ``mean`` and the ``variance`` of that mean, arrays of one shape whose first axis counts receivers or probes."""

    mean: np.ndarray
    variance: np.ndarray

    @staticmethod
    def of(estimate: Estimate) -> "Truth":
        """The path tracer's ``estimate``."""
        return Truth(estimate.mean.astype(np.float64), estimate.standard_error.astype(np.float64) ** 2)

    @property
    def noise(self) -> float:
        """The reference's own relative RMSE, by its standard error; 0 where it is black."""
        power = float(np.sum(np.square(self.mean, dtype=np.float64)))
        return float(np.sqrt(np.sum(self.variance, dtype=np.float64) / power)) if power > 0 else 0.0


class Reference(Protocol):
    """An independent answer, as exact as time allows. ``kind`` names it in reports."""

    kind: str

    def irradiance(self, receivers: Receivers, progress: Progress) -> Truth:
        """Irradiance (n, 3) [W·m⁻²] at ``receivers``, of all indirect light (docs/physics.md §1)."""

    def probes(self, points: np.ndarray, order: int, progress: Progress) -> Truth:
        """SH (n, (order + 1)², 3) of what arrives at free ``points`` (n, 3)."""


class PathReference:
    """The path tracer, with as many paths as bring its noise to ``noise`` (relative RMSE), and no more than ``most_paths`` for all
    points together.

    The same scene, receivers and seed give the same numbers for any number of threads.
    """

    kind = "path"

    def __init__(self, context: LightContext, noise: float = 0.01, most_paths: int = MOST_PATHS, seed: int = 1):
        self.context, self.noise, self.most_paths, self.seed = context, noise, most_paths, seed

    def irradiance(self, receivers: Receivers, progress: Progress | None = None, knows: frozenset[str] = KNOWN_LIGHT) -> Truth:
        """See Reference. ``knows`` leaves only that light, for techniques that know no more (Technique.knows)."""
        context = self.context if knows == KNOWN_LIGHT else LightContext(limited(self.context.scene, knows), self.context.threads)
        bounces = None if "bounces" in knows else 1

        def trace(paths, seed, part):
            return irradiance_at(context, receivers.points, receivers.normals, paths, bounces=bounces, seed=seed, progress=part)

        return self._refined(trace, len(receivers.points), progress or Progress())

    def probes(self, points: np.ndarray, order: int, progress: Progress | None = None) -> Truth:
        """See Reference."""
        def trace(paths, seed, part):
            return probe_sh(self.context, points, order, paths, seed=seed, progress=part)

        return self._refined(trace, len(points), progress or Progress())

    def _refined(self, trace, points: int, progress: Progress) -> Truth:
        most = max(self.most_paths // max(points, 1), 1)
        pilot_paths = min(PILOT_PATHS, most)
        pilot = Truth.of(trace(pilot_paths, self.seed, progress.span(0.0, _PILOTED)))
        missing = pilot_paths * ((pilot.noise / self.noise) ** 2 - 1.0)
        paths = int(min(missing, most - pilot_paths))
        if paths <= 0:
            return pilot
        rest = Truth.of(trace(paths, self.seed + 1, progress.span(_PILOTED, 1.0)))
        share = np.float64(pilot_paths / (pilot_paths + paths))
        return Truth(share * pilot.mean + (1 - share) * rest.mean, share**2 * pilot.variance + (1 - share) ** 2 * rest.variance)


def limited(scene: Scene, knows: frozenset[str]) -> Scene:
    """``scene`` with only the light sources in ``knows`` (a part of KNOWN_LIGHT)."""
    materials = scene.materials if "emissive surfaces" in knows else tuple(material.shining(0.0) for material in scene.materials)
    return replace(scene, lights=scene.lights if "lamps" in knows else (), materials=materials,
                   world=scene.world if "world" in knows else World.constant(0.0))
