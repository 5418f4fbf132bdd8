"""The two interfaces every technique keeps: ``Technique.bake`` makes a ``Field``; a ``Field`` answers for irradiance."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields, replace
from typing import ClassVar

import numpy as np

from ..errors import UsageError
from ..progress import Progress
from ..scene import ProbeVolume, Scene


def setting(default, label, description, unit="", minimum=None, maximum=None, choices=None):
    """A field of a ``Settings`` dataclass with what a panel and a command line need to show it."""
    return field(default=default, metadata={
        "label": label, "description": description, "unit": unit, "minimum": minimum, "maximum": maximum, "choices": choices,
    })


def validate_settings(settings) -> None:
    """Check every field of a ``Settings`` instance against its declared range. Raises UsageError naming the setting."""
    for item in fields(settings):
        value, meta = getattr(settings, item.name), item.metadata
        if value is None:
            continue
        if meta.get("choices") and value not in meta["choices"]:
            raise UsageError(f"{item.name} is {value!r}", f"choose one of {', '.join(map(str, meta['choices']))}")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            continue
        low, high = meta.get("minimum"), meta.get("maximum")
        if not np.isfinite(value) or (low is not None and value < low) or (high is not None and value > high):
            raise UsageError(f"{item.name} is {value:g}", f"give a value from {low} to {high}")


def volumes_by_settings(volumes: tuple[ProbeVolume, ...], settings) -> list[tuple[object, tuple[ProbeVolume, ...]]]:
    """Volumes grouped by their settings, where a volume's own overrides replace those of the bake's ``settings``.

    Raises UsageError for an override out of range; those that the technique does not have are left aside.
    """
    groups: dict[object, list[ProbeVolume]] = {}
    known = {item.name for item in fields(settings)}
    for volume in volumes:
        own = replace(settings, **{name: value for name, value in volume.settings.items() if name in known})
        validate_settings(own)
        groups.setdefault(own, []).append(volume)
    return [(own, tuple(members)) for own, members in groups.items()]


@dataclass(frozen=True, eq=False)
class ProbeGrid:
    """The result for one volume; arrays are indexed [z, y, x] like the bundle's flipbooks.

    ``sh`` (nz, ny, nx, (L+1)², 3) float32: projection of incident radiance, world axes (PHYSICS.md §1), as measured, no dering.
    ``validity`` (nz, ny, nx) float32: 1 usable, 0 inside geometry, between = share of front-facing hits, at the lattice point.
    ``visibility`` (nz, ny, nx, T, T, 2) float32: octahedral tile (row = y of the map) of mean distance [m] and mean squared
    distance [m²]. ``offset_world`` (nz, ny, nx, 3) float32: how far the probe was moved out of geometry [m], 0 where it was not.
    ``standard_error`` (nz, ny, nx) float32: estimated RMS error of a probe's coefficients, in their unit; NaN where unknown.
    """

    volume: ProbeVolume
    sh: np.ndarray
    validity: np.ndarray
    visibility: np.ndarray
    offset_world: np.ndarray
    standard_error: np.ndarray

    @property
    def order(self) -> int:
        """SH order L."""
        return round(np.sqrt(self.sh.shape[3])) - 1

    @property
    def usable(self) -> np.ndarray:
        """(nz, ny, nx) bool: probes whose coefficients were measured at their lattice point, outside geometry."""
        return (self.validity >= 1.0 - BACKFACE_THRESHOLD) & ~np.any(self.offset_world != 0, axis=-1)


# Above this share of hits on the inside of closed solids a probe counts as inside geometry (RTXGI-DDGI's default).
BACKFACE_THRESHOLD = 0.25


class Field(ABC):
    """Indirect irradiance everywhere, as one technique knows it: view-independent and immutable.

    ``includes_direct`` says whether the light of lamps is in it; ``params`` and ``stats`` are JSON-able dictionaries; ``notes`` are
    lines for the user about what this field of this scene leaves out.
    """

    technique: str = ""
    includes_direct: bool = False
    notes: tuple[str, ...] = ()
    params: dict
    stats: dict

    @abstractmethod
    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) [W·m⁻²] at ``points`` (n, 3) on surfaces with unit ``normals`` (n, 3), world space; never negative."""

    @abstractmethod
    def arrays(self) -> dict[str, np.ndarray]:
        """Everything needed to rebuild the field, by name."""

    def grids(self) -> tuple[ProbeGrid, ...]:
        """The field as probe grids on the scene's volumes: what the bundle stores."""
        raise NotImplementedError(f"{type(self).__name__} has no probe grids")


class Checkpoint:
    """Where a long bake leaves its finished parts. This base keeps nothing; the job's own writes files beside the bundle.

    A technique calls ``save`` whenever ``due`` is true, with everything that its remaining work depends on, and asks
    ``load`` first: a resumed bake ends with the very bytes an uninterrupted one gives.
    """

    @property
    def due(self) -> bool:
        """True if the last ``save`` lies long enough back."""
        return False

    def save(self, name: str, arrays: dict[str, np.ndarray]) -> None:
        """Store ``arrays`` under ``name``, replacing what was there, in one step."""

    def load(self, name: str) -> dict[str, np.ndarray] | None:
        """What was stored under ``name``, or None."""
        return None


# From quick to exact. A technique without a preset keeps its settings.
PRESETS = ("draft", "preview", "final")

# What indirect irradiance is made of (PHYSICS.md §1).
KNOWN_LIGHT = frozenset({"lamps", "emissive surfaces", "world", "bounces"})


class Technique(ABC):
    """One GI technique: a name, a frozen ``Settings`` dataclass, and ``bake``.

    ``tolerance`` is the relative error of irradiance that it declares for scenes with a closed form, at default settings;
    ``knows`` names the light in its fields, of KNOWN_LIGHT; without "bounces" they hold the first bounce of it. ``devices`` says
    where it can bake; one that knows "gpu" takes ``kernels`` in its ``bake`` (techniques/kernels.py). ``lattices`` are factors of
    the volumes' resolution at which a chart measures its defaults as well, if its field lives on the lattice. ``presets`` holds, by
    name (of PRESETS), the settings that decide what quality costs; all of them name the same ones.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    description: ClassVar[str]
    Settings: ClassVar[type]
    tolerance: ClassVar[float] = 0.02
    knows: ClassVar[frozenset[str]] = KNOWN_LIGHT
    devices: ClassVar[tuple[str, ...]] = ("cpu",)
    lattices: ClassVar[tuple[float, ...]] = ()
    presets: ClassVar[dict[str, dict]] = {}

    @abstractmethod
    def bake(self, scene: Scene, settings, rng: np.random.Generator, progress: Progress, *, threads: int | None = None,
             checkpoint: Checkpoint | None = None) -> Field:
        """Bake every volume of ``scene``. The same ``rng`` seed gives the same bytes for any number of ``threads``
        (None = every core). Raises BakeError for what the user can mend, Cancelled when asked to stop."""

    def sweep(self) -> tuple:
        """Settings from cheap to dear that a chart of speed against accuracy measures, the defaults among them."""
        return (self.Settings(),)
