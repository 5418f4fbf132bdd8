"""By how much two renderers differ, and who makes the difference: suspects are left out or replaced one at a time, in both."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ...transport.paths.reference import irradiance_at
from ..metrics import Figure, noise_of_sites, relative_rmse_of_sites
from ..references import Truth
from .places import Places
from .suspects import Suspect, replaced

# One-sided 95 % quantile of the normal distribution.
_SURE = 1.645
# Without a culprit the difference is at most this share of the one with it: of two that make as much, each leaves 0.71.
_EXPLAINED = 0.8
_MOST_CULPRITS = 3
# How far a comparison is when the other renderer has answered.
_JUDGED = 0.7
# Suspects that are tried again once a culprit was found, and the share of the light that must be left to tell anything.
_AGAIN, _LEAST_LIGHT = 4, 0.02


class Judge(Protocol):
    """The other renderer. ``kind`` names it in reports; ``sees_media`` says whether it answers at places within media, too."""

    kind: str
    sees_media: bool

    def irradiance(self, places: Places, without: tuple[Suspect, ...], progress: Progress) -> Truth:
        """Irradiance (n, 3) [W·m⁻²] at ``places``, lamps included, in the scene ``without`` some suspects (see Suspect)."""


@dataclass(frozen=True)
class Difference:
    """The relative RMS difference of irradiance, noise taken out, with its standard error over the choice of places; ``noise`` is
    the part of that error which noise makes at these very places. ``light`` is the reference's mean irradiance, by which one sees
    whether there is anything to compare."""

    figure: Figure
    noise: float
    light: float

    @staticmethod
    def of(parts, light: float) -> "Difference":
        """From (estimate, reference, variance) of each kind of place."""
        return Difference(relative_rmse_of_sites(parts), noise_of_sites(parts), light)

    def exceeds(self, bound: float) -> bool:
        """Whether the two surely differ by more than ``bound`` at these places (with 95 % confidence)."""
        return self.figure.value - _SURE * self.noise > bound


@dataclass(frozen=True)
class Culprit:
    """A suspect, and what differs once it is left out or replaced, together with those found before it."""

    suspect: Suspect
    remaining: Difference


def compare(scene: Scene, judge: Judge, places: Places, without: tuple[Suspect, ...], paths: int, threads: int | None, seed: int,
            progress: Progress) -> tuple[Difference, Truth, Truth]:
    """How much ours and the judge's light differ in ``scene`` ``without`` some suspects; ours and theirs."""
    theirs = judge.irradiance(places, without, progress.span(0.0, _JUDGED))
    context = LightContext(replaced(scene, without), threads)
    estimate = irradiance_at(context, places.points, places.normals, paths, seed=seed, direct=True,
                             progress=progress.span(_JUDGED, 1.0))
    ours = Truth.of(estimate)
    parts = list(zip(*(places.sites(values) for values in (ours.mean, theirs.mean, ours.variance + theirs.variance)), strict=True))
    return Difference.of(parts, float(theirs.mean.mean())), ours, theirs


def search(measure: Callable[[tuple[Suspect, ...], Progress], Difference], base: Difference, suspects: tuple[Suspect, ...],
           known: int, within: float, progress: Progress) -> tuple[tuple[Culprit, ...], dict[Suspect, Difference]]:
    """Those of ``suspects`` without whom ``measure`` finds the two within ``within``, or nearer than before; at most three, one
    after another. Also what each made alone, as far as they were tried. ``base`` is the difference with all of them. The first
    ``known`` suspects are not followed anyway: if the two agree without one of them, nobody else is tried.
    """
    culprits: list[Culprit] = []
    alone: dict[Suspect, Difference] = {}
    best = base
    while best.exceeds(within) and len(culprits) < _MOST_CULPRITS:
        taken = tuple(culprit.suspect for culprit in culprits)
        left = [suspect for suspect in suspects if suspect not in taken]
        if culprits:  # those that helped alone come first, and few of them
            left = sorted(left, key=lambda suspect: alone[suspect].figure.value)[:_AGAIN]
        trials: list[Culprit] = []
        for number, suspect in enumerate(left):
            trying = progress.span(number / len(left), (number + 1) / len(left))
            trying.step(0.0, f"Without {suspect}")
            remaining = measure((*taken, suspect), trying)
            if not culprits:
                alone[suspect] = remaining
            # Without any light there is nothing to disagree about.
            if remaining.light > _LEAST_LIGHT * base.light:
                trials.append(Culprit(suspect, remaining))
            if trials and number < known and not culprits and not remaining.exceeds(within) and trials[-1].suspect == suspect:
                break
        culprit = _first_of_the_best(trials)
        if culprit is None or culprit.remaining.figure.value > _EXPLAINED * best.figure.value:
            break
        culprits.append(culprit)
        best = culprit.remaining
    return tuple(culprits), alone


def _first_of_the_best(trials: list[Culprit]) -> Culprit | None:
    """The first trial that is as good as any, as far as noise lets one tell: the likelier suspects come first."""
    if not trials:
        return None
    best = min((trial.remaining for trial in trials), key=lambda remaining: remaining.figure.value)
    return next(trial for trial in trials
                if trial.remaining.figure.value <= best.figure.value + _SURE * (best.noise + trial.remaining.noise))
