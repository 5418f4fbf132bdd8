"""A scene as it was read, and a bake of it, held to another renderer at a few places: do they agree, and if not, what differs."""

import time
from dataclasses import dataclass, replace

import numpy as np

from ..errors import BakeError
from ..evaluate.concerns import MEASURED, Concern, concerns
from ..evaluate.metrics import Figure
from ..evaluate.references import Truth, limited
from ..evaluate.verify import Culprit, Difference, Judge, Places, Suspect, choose_places, leaves_surfaces, search, suspects_of
from ..evaluate.verify.places import radiance_from_patches, variance_from_patches
from ..evaluate.verify.search import compare
from ..exchange.plain import plain
from ..progress import Progress
from ..scene import ProbeVolume, Scene, baked_part
from ..scene.capture import captured_light, direct_light
from ..scene.lights import BOUNCES_ONLY, lamps_to_add
from ..techniques import Field
from ..techniques.lattice.coverage import require_usable
from ..transport.context import LightContext
from ..transport.paths.reference import irradiance_at

# Places, paths from each of ours, the difference up to which two renderers agree, and how many suspects are tried.
POINTS, PROBES, PATHS, WITHIN, MOST_SUSPECTS = 96, 8, 1024, 0.05, 12
# How far it is when both have answered, before anyone is suspected.
_COMPARED = 0.3


@dataclass(frozen=True)
class VerifyReport:
    """How far a scene and its bake are from ``judge``.

    ``as_read`` is the difference of the scene as it was read, path traced, at ``points`` surface points and ``probes`` probes;
    ``baked`` that of the bake's probes (None: none was given). ``culprits`` are who make the difference of ``as_read``, found one
    after another, ``alone`` what each suspect made by itself, ``not_followed`` what of the file was known not to be, measured
    where it was tried. ``within`` is the difference that counts as agreement.
    """

    scene: str
    judge: str
    points: int
    probes: int
    within: float
    as_read: Difference
    baked: Difference | None
    culprits: tuple[Culprit, ...]
    alone: dict[Suspect, Difference]
    not_followed: tuple[Concern, ...]
    seconds: float

    @property
    def headline(self) -> Difference:
        """What is asked for: the bake's difference where there is one, else the reading's."""
        return self.as_read if self.baked is None else self.baked

    @property
    def agrees(self) -> bool:
        """Whether neither is surely further off than ``within``."""
        return not any(found is not None and found.exceeds(self.within) for found in (self.as_read, self.baked))

    @property
    def verdict(self) -> str:
        """One line about it."""
        if self.agrees:
            return f"{self.scene} agrees with {self.judge} within {difference_text(self.headline.figure)}"
        worse = self.as_read if self.as_read.exceeds(self.within) else self.baked
        return f"{self.scene} differs from {self.judge} by {difference_text(worse.figure)}"

    @property
    def reason(self) -> str:
        """What makes the difference, where they do not agree."""
        if self.culprits:
            names = " and ".join(str(culprit.suspect) for culprit in self.culprits)
            return f"{names} make the difference" if len(self.culprits) > 1 else f"{names} makes the difference"
        if self.as_read.exceeds(self.within):
            return f"none of {len(self.alone)} suspects makes it by itself"
        return "the scene was read right, so it is the bake's technique, its settings, or a scene that has changed since"

    @property
    def refusal(self) -> BakeError | None:
        """Why the command has failed, or None."""
        return None if self.agrees else BakeError(self.verdict, self.reason)

    def to_json(self) -> dict:
        """The report as JSON-able values."""
        return plain({
            "scene": self.scene, "judge": self.judge, "agrees": self.agrees, "within": self.within, "points": self.points,
            "probes": self.probes, "as_read": _values(self.as_read), "baked": self.baked and _values(self.baked),
            "culprits": [_entry(culprit.suspect, culprit.remaining) for culprit in self.culprits],
            "tried": [_entry(suspect, remaining) for suspect, remaining in self.alone.items()],
            "not_followed": [concern.to_json() for concern in self.not_followed], "seconds": self.seconds})

    def to_text(self) -> str:
        """The report as lines for a person."""
        lines = [self.verdict + ("" if self.agrees else f": {self.reason}"),
                 f"  as read  {difference_text(self.as_read.figure)} at {self.points} surface points and {self.probes} probes"]
        if self.baked is not None:
            lines.append(f"  baked    {difference_text(self.baked.figure)} at {self.probes} probes")
        lines += [f"  without  {culprit.suspect}: {difference_text(culprit.remaining.figure)}" for culprit in self.culprits]
        lines += [f"  omitted  {concern}" for concern in self.not_followed]
        return "\n".join([*lines, f"  seconds  {self.seconds:.1f}"])


def verify(scene: Scene, judge: Judge, field: Field | None = None, *, not_followed: tuple[Concern, ...] = (), points: int = POINTS,
           probes: int = PROBES, paths: int = PATHS, within: float = WITHIN, most_suspects: int = MOST_SUSPECTS, seed: int = 0,
           threads: int | None = None, progress: Progress | None = None) -> VerifyReport:
    """Hold ``scene``, and the ``field`` that was baked of it (None: only the reading), to ``judge``.

    ``paths`` are ours from each place. Where the reading is surely further off than ``within``, at most ``most_suspects`` suspects
    are tried (0: none). ``not_followed`` are the concerns of a bake; without them they are estimated here. Raises BakeError,
    Cancelled.
    """
    progress, started = progress or Progress(), time.monotonic()
    progress.stage("verify")
    context = LightContext(scene, threads)
    if field is None:
        require_usable(scene, threads)
    volumes = scene.volumes if field is None else tuple(grid.volume for grid in field.grids())
    moved = 0.0 if field is None else np.concatenate([grid.offset_world.reshape(-1, 3) for grid in field.grids()])
    places = choose_places(context, volumes, points, probes, seed, moved, judge.sees_media)
    base, _, theirs = compare(scene, judge, places, (), paths, threads, seed, progress.span(0.0, _COMPARED))
    baked = None if field is None else _of_bake(scene, field, places, theirs, paths, threads, seed)

    def measure(without: tuple[Suspect, ...], part: Progress) -> Difference:
        return compare(scene, judge, places, without, paths, threads, seed, part)[0]

    told = not_followed or concerns(context, places.probes, scene.omissions, seed)
    culprits, alone = (), {}
    if most_suspects and base.exceeds(within):
        known, others = suspects_of(context, places.probes, tuple(concern.omission for concern in told), seed)
        # Most of what is only nearly followed is harmless: it must not crowd out all others.
        known = known[:max(most_suspects // 2, 1)]
        known, others = ([suspect for suspect in part if leaves_surfaces(scene, (suspect,))] for part in (known, others))
        suspects = (*known, *others)[:most_suspects]
        culprits, alone = search(measure, base, suspects, len(known), within, progress.span(_COMPARED, 1.0))
    progress.step(1.0, "Done")
    return VerifyReport(scene.name, judge.kind, places.surfaces, len(places.probes), within, base, baked, culprits, alone,
                        tuple(_measured(concern, base, alone) for concern in told), time.monotonic() - started)


def _of_bake(scene: Scene, field: Field, places: Places, theirs: Truth, paths: int, threads: int | None,
             seed: int) -> Difference:
    """How far the bake's probes are from what the judge saw around them, less what they are not meant to hold."""
    coefficients = np.concatenate([grid.sh.reshape(-1, *grid.sh.shape[-2:]) for grid in field.grids()])[places.lattice, :4]
    known = coefficients.shape[1]
    mean, variance = (places.sites(values)[1] for values in (theirs.mean, theirs.variance))
    points, normals = (places.sites(values)[1] for values in (places.points, places.normals))
    mean, variance = mean.copy(), variance.copy()
    for volume, rows in _by_volume(scene, field, places.lattice):
        at = points[rows].reshape(-1, 3), normals[rows].reshape(-1, 3)
        for sign, estimate in _held_otherwise(scene, volume, field, *at, paths, threads, seed):
            mean[rows] += sign * estimate.mean.reshape(mean[rows].shape)
            variance[rows] += np.square(estimate.standard_error, dtype=np.float64).reshape(variance[rows].shape)
    part = (coefficients.astype(np.float64), radiance_from_patches(mean)[:, :known], variance_from_patches(variance)[:, :known])
    return Difference.of([part], float(mean.mean()))


def _by_volume(scene: Scene, field: Field, lattice: np.ndarray):
    """The volumes of ``field``, as the file has them now, with the rows of the probes ``lattice`` (p,) that are theirs."""
    now = {volume.name: volume for volume in scene.volumes}
    start = 0
    for grid in field.grids():
        stop = start + grid.validity.size
        rows = np.flatnonzero((lattice >= start) & (lattice < stop))
        start = stop
        if rows.size:
            yield now.get(grid.volume.name, grid.volume), rows


def _held_otherwise(scene: Scene, volume: ProbeVolume, field: Field, points, normals, paths: int, threads: int | None, seed: int):
    """What ``volume`` holds more (+1) or less (−1) than all the light at ``points`` under ``normals``, as the path tracer has it:
    (sign, Estimate)."""
    def lamps(lit: Scene, lights):
        alone = limited(replace(lit, lights=lights), frozenset({"lamps"}))
        return irradiance_at(LightContext(alone, threads), points, normals, paths, bounces=0, seed=seed, direct=True)

    added = lamps_to_add(baked_part(scene).lights, field.direct_lamps)
    if volume.captures_all:
        if added:
            yield -1.0, lamps(scene, added)
        return
    yield -1.0, irradiance_at(LightContext(scene, threads), points, normals, paths, seed=seed, direct=True)
    captured = captured_light(scene, volume)
    bounced = replace(captured, lights=tuple(replace(light, bake=BOUNCES_ONLY) for light in baked_part(captured).lights))
    yield 1.0, irradiance_at(LightContext(bounced, threads), points, normals, paths, seed=seed)
    strong = direct_light(baked_part(scene), volume)
    held = tuple(light for light in strong.lights if light not in lamps_to_add((light,), field.direct_lamps))
    if held:
        yield 1.0, lamps(strong, held)


def _measured(concern: Concern, base: Difference, alone: dict[Suspect, Difference]) -> Concern:
    """``concern`` with the difference that its objects and materials were found to make, where one of them was tried."""
    names = {*concern.omission.objects, *concern.omission.materials}
    remaining = [found.figure.value for suspect, found in alone.items() if suspect.name in names]
    if not remaining:
        return concern
    return replace(concern, share=float(np.sqrt(max(base.figure.value**2 - min(remaining) ** 2, 0.0))), how=MEASURED)


def difference_text(figure: Figure) -> str:
    """A difference for a person; what noise hides is told as what it is less than."""
    if figure.value < figure.standard_error:
        return f"{100 * (figure.value + figure.standard_error):.2g} %"
    return f"{100 * figure.value:.2g} % ± {100 * figure.standard_error:.2g} %"


def _values(difference: Difference) -> dict:
    return {"difference": difference.figure.value, "standard_error": difference.figure.standard_error}


def _entry(suspect: Suspect, remaining: Difference) -> dict:
    return {"kind": suspect.kind, "name": suspect.name, "without": _values(remaining)}
