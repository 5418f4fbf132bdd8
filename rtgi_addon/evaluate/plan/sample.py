"""Receivers that a lattice answers for: surface points inside its volumes, drawn like the chart's (evaluate/receivers.py)."""

from typing import NamedTuple

import numpy as np

from ...errors import BakeError
from ...numerics.grid import local_from_world
from ...numerics.heavy_tail import interval_of_another_draw
from ...scene import ProbeVolume
from ...techniques.lattice.focus import probes_of, spacing_of
from ...transport.context import LightContext
from ..measure import LIFT
from ..metrics import Figure
from ..receivers import Receivers, open_probes, surface_receivers
from ..references import Truth

# The surface's own normal and a tilted one, which stands for the three that a chart has beside it.
NORMALS_PER_POINT = 2
NORMAL_WEIGHTS = np.array([0.5, 1.5])
# Draws of points before those that are still missing are given up, and the share of the first draw that has to lie in the volumes
# if only such points are to count.
DRAWS, FEWEST_WITHIN = 4, 0.25


class NothingToSee(BakeError):
    """Probes see no surface that a plan could be held to."""


class Sample(NamedTuple):
    """``receivers``, NORMALS_PER_POINT for each point one after another; ``within`` is the share of all seen points that lie in the
    volumes, and ``only_within`` says whether the receivers are those alone; ``eyes`` (p, 3) are the open probes that see them;
    ``lift`` [m] is how far tilted receivers stand off their surface."""

    receivers: Receivers
    within: float
    only_within: bool
    eyes: np.ndarray
    lift: float

    @property
    def points(self) -> int:
        """Number of surface points."""
        return len(self.receivers.points) // NORMALS_PER_POINT

    def error(self, estimate: np.ndarray, truth: Truth, forgiven: np.ndarray | float = 0.0, trimmed: float = 0.0) -> Figure:
        """Relative RMSE of ``estimate`` (n, 3) at the first n receivers, weighted as in a chart, and its standard error over
        points. The variance of ``truth`` and ``forgiven`` (n, 3), the estimate's own, are taken out; the worst points, a share
        ``trimmed`` of them, are left out."""
        off, power = self.squares(estimate, truth, forgiven)
        if trimmed:
            rows = np.argsort(off, kind="stable")[:len(off) - int(np.ceil(trimmed * len(off)))]
            off, power = off[rows], power[rows]
        return _root_ratio_figure(off, power)

    def interval(self, estimate: np.ndarray, truth: Truth, confidence: float) -> tuple[float, float]:
        """Between what two values ``error`` lies at as many other points, with ``confidence``."""
        return interval_of_another_draw(*self.squares(estimate, truth, 0.0), confidence)

    def concentration(self, estimate: np.ndarray, truth: Truth, share: float) -> float:
        """What the worst ``share`` of the points has of the squared error of ``estimate`` (n, 3)."""
        off = np.sort(np.maximum(self.squares(estimate, truth, 0.0)[0], 0.0))
        total = float(off.sum())
        return float(off[-max(1, round(share * len(off))):].sum()) / total if total > 0 else 0.0

    @staticmethod
    def squares(estimate, truth: Truth, forgiven) -> tuple[np.ndarray, np.ndarray]:
        """Squared error of ``estimate`` (n, 3) and squared truth (p,) of each point, the variance of the truth and what is
        ``forgiven`` taken out."""
        weights = np.tile(NORMAL_WEIGHTS, len(estimate) // NORMALS_PER_POINT)[:, None]
        points = (-1, NORMALS_PER_POINT * 3)
        mean, variance = (values[:len(estimate)] for values in truth)
        return ((weights * ((estimate - mean) ** 2 - variance - forgiven)).reshape(points).sum(axis=1),
                (weights * (mean**2 - variance)).reshape(points).sum(axis=1))


def _root_ratio_figure(off: np.ndarray, power: np.ndarray) -> Figure:
    """√(Σ off / Σ power) over points (p,), with the standard error of a ratio of sums (linearised)."""
    total, count = float(power.sum()), len(power)
    if total <= 0.0:
        return Figure(0.0 if off.sum() <= 0.0 else np.inf, np.nan)
    ratio = max(float(off.sum()) / total, 0.0)
    spread = np.sqrt(count / max(count - 1, 1) * np.sum((off - ratio * power) ** 2)) / total
    # Near 0 the root is not linear: there the whole of the spread may be error.
    return Figure(ratio**0.5, float(min(0.5 * spread / max(ratio, 1e-30) ** 0.5, spread**0.5)))


def draw_sample(context: LightContext, volumes: tuple[ProbeVolume, ...], points: int, seed: int) -> Sample:
    """Some ``points`` surface points that open probes of ``volumes`` see. Another ``seed`` gives independent ones.

    Points outside the volumes are left out, since no probe promises anything there, unless nearly all are outside. Raises
    BakeError if no probe lies in the open or no surface can be seen.
    """
    eyes = probes_of(volumes)[open_probes(context, volumes)]
    if not len(eyes):
        raise BakeError("no probe lies in the open", "move the Light Probe Volume out of geometry")
    lift = LIFT * spacing_of(volumes)
    draws, inside, count = [], [], 0
    for number in range(DRAWS):
        draw_seed = int(np.random.default_rng([seed, number]).integers(1 << 31))
        draw = surface_receivers(context, eyes, points, NORMALS_PER_POINT, draw_seed, lift)
        if not len(draw.points):
            break
        draws.append(draw)
        inside.append(covered(volumes, draw.points[draw.own]))
        count += int(inside[-1].sum())
        if count >= points or inside[0].mean() < FEWEST_WITHIN:
            break
    if not draws:
        raise NothingToSee("no surface can be seen from any probe", "move the Light Probe Volume to the geometry")
    receivers, inside = Receivers(*(np.concatenate(arrays) for arrays in zip(*draws, strict=True))), np.concatenate(inside)
    only_within = bool(inside[:points].mean() >= FEWEST_WITHIN)
    rows = np.flatnonzero(inside)[:points] if only_within else np.arange(min(points, len(inside)))
    rows = (rows[:, None] * NORMALS_PER_POINT + np.arange(NORMALS_PER_POINT)).ravel()
    return Sample(receivers.take(rows), float(inside.mean()), only_within, eyes, lift)


def covered(volumes: tuple[ProbeVolume, ...], points: np.ndarray) -> np.ndarray:
    """(n,) bool: which ``points`` (n, 3) lie in one of ``volumes`` or less than half a cell outside it."""
    inside = np.zeros(len(points), bool)
    for volume in volumes:
        local = np.abs(local_from_world(volume.world_from_local, points))
        inside |= np.all(local <= 1.0 + 1.0 / np.asarray(volume.resolution), axis=1)
    return inside
