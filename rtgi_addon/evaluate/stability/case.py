"""What a stability case is: a failure known from the literature, a parametric scene that shows it, a number for how bad it is.

Every figure is 0 where nothing fails and grows with the failure. A case declares a ``goal``, which a technique without this
weakness meets, and `limits` hold for each technique a bound that its figure stays under today: above the goal it is a weakness
that is known and has a reason; above the bound something has become worse.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ... import techniques
from ...progress import Progress
from ...scene import Scene
from ...techniques import Field
from .limits import LIMITS, Limit

# Keys of a variant's settings that are none of the technique's: fields of the probes' LookupSettings, and whether light that moves
# is baked anew instead of relit.
LOOKUP, ANEW = "lookup", "anew"
HOLDS, WEAK, WORSE, ABOVE = "holds", "known weakness", "worse than its bound", "above its goal"


@dataclass(frozen=True, eq=False)
class Variant:
    """The same case under other ``settings`` (LOOKUP and ANEW too): a remedy left out (``remedy`` False), or one that is no default
    (True)."""

    name: str
    settings: dict[str, Any]
    remedy: bool = False


@dataclass(frozen=True, eq=False)
class Sample:
    """One step of a sweep: the ``parameter`` as text, the figure there, and what was baked (None where nothing is to be drawn)."""

    parameter: str
    value: float
    scene: Scene | None = None
    field: Field | None = None


@dataclass(frozen=True, eq=False)
class Bench:
    """What a case measures with: one technique under ``settings``, one ``seed``."""

    technique: str
    settings: dict[str, Any] = field(default_factory=dict)
    seed: int = 1
    threads: int | None = None
    progress: Progress = field(default_factory=Progress)

    def bake(self, scene: Scene, **settings) -> Field:
        """The field of ``scene``. The case's ``settings`` (those the technique has) give way to the bench's own."""
        self.progress.check()
        method = techniques.get(self.technique)
        wanted = {**{name: value for name, value in settings.items() if name in method.Settings.__dataclass_fields__},
                  **self.settings}
        lookup, _ = wanted.pop(LOOKUP, None), wanted.pop(ANEW, None)
        baked = method.bake(scene, method.Settings(**wanted), np.random.default_rng(self.seed),
                            # What it does is shown and can be cancelled; how far the case is, is the case's to say.
                            self.progress.span(0.0, 0.0), threads=self.threads)
        return baked if lookup is None else baked.with_lookup(replace(baked.lookup, **lookup))


@dataclass(frozen=True, eq=False)
class Case:
    """One failure. ``scene``, ``metric`` and ``sweep`` say in words what ``measure(bench)`` does, which gives the samples of the
    sweep. ``variants`` are by technique. A case on a user's own scene names its ``file`` and brings ``remedies``, by technique what
    makes the figure smaller: no bound can be stored for such a scene, so it is held to the goal alone."""

    name: str
    failure: str
    scene: str
    metric: str
    sweep: str
    goal: float
    measure: Callable[[Bench], list[Sample]]
    variants: dict[str, tuple[Variant, ...]] = field(default_factory=dict)
    file: str = ""
    remedies: dict[str, str] | None = None

    @property
    def limits(self) -> dict[str, Limit]:
        """What each technique that the case concerns is held to."""
        if self.remedies is not None:
            return {technique: Limit(np.inf, remedy) for technique, remedy in self.remedies.items()}
        return LIMITS[self.name]


@dataclass(frozen=True, eq=False)
class Result:
    """A case as one technique stands it: ``samples`` of the sweep, or of the variant's."""

    case: Case
    technique: str
    samples: tuple[Sample, ...]
    seconds: float
    variant: Variant | None = None

    def without_fields(self) -> "Result":
        """The same figures without what was baked for them, which is large."""
        return replace(self, samples=tuple(Sample(sample.parameter, sample.value) for sample in self.samples))

    @property
    def worst(self) -> Sample:
        """The sample with the largest value; one that is not finite counts as that."""
        return max(self.samples, key=lambda sample: sample.value if np.isfinite(sample.value) else np.inf)

    @property
    def figure(self) -> float:
        """The largest value of the sweep."""
        return self.worst.value

    @property
    def limit(self) -> Limit:
        """What the technique is held to."""
        return self.case.limits[self.technique]

    @property
    def verdict(self) -> str:
        """HOLDS, WEAK or WORSE, on a user's own scene HOLDS or ABOVE; a figure that is not a number is the worst."""
        if self.case.remedies is not None:
            return HOLDS if self.figure <= self.case.goal else ABOVE
        if not self.figure <= self.limit.bound:
            return WORSE
        return HOLDS if self.figure <= self.case.goal else WEAK

    @property
    def command(self) -> str:
        """What to type to see this result alone."""
        file = f'"{self.case.file}" ' if self.case.file else ""
        return f"python -m rtgi_addon {file}stability --case {self.case.name} --technique {self.technique} --out stability"
