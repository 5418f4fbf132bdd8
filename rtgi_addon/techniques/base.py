"""The two interfaces every technique keeps: ``Technique.bake`` makes a ``Field``; a ``Field`` answers for irradiance."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from ..errors import BakeError, UsageError
from ..numerics import sh
from ..numerics.grid import box_corners
from ..progress import Progress
from ..scene import Omission, ProbeVolume, Scene
from ..transport.context import LightContext


def setting(default, label, description, unit="", minimum=None, maximum=None, choices=None, or_object=None):
    """A field of a ``Settings`` dataclass with what a panel and a command line need to show it: a bool, int, float or str, one of
    ``choices``, or a colour, annotated tuple[float, float, float], scene-linear. A str with ``or_object`` is one of those words or
    the name of an object."""
    return field(default=default, metadata={
        "label": label, "description": description, "unit": unit, "minimum": minimum, "maximum": maximum, "choices": choices,
        "or_object": or_object,
    })


def validate_settings(settings) -> None:
    """Check every field of a ``Settings`` instance against its declared range. Raises UsageError naming the setting."""
    for item in fields(settings):
        value, meta = getattr(settings, item.name), item.metadata
        if value is None:
            continue
        if meta.get("choices") and value not in meta["choices"]:
            raise UsageError(f"{item.name} is {value!r}", f"choose one of {', '.join(map(str, meta['choices']))}")
        low, high = meta.get("minimum"), meta.get("maximum")
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, bool) or not isinstance(number, (int, float)):
                continue
            if not np.isfinite(number) or (low is not None and number < low) or (high is not None and number > high):
                raise UsageError(f"{item.name} is {number:g}",
                                 f"give at least {low}" if high is None else f"give a value from {low} to {high}")


def begin_bake(scene: Scene, settings, rng: np.random.Generator, progress: Progress,
               threads: int | None, context: LightContext | None = None) -> tuple[LightContext, int]:
    """What every bake begins with: ``scene`` made ready for rays, and the seed of all that is random. A ``context`` of the same
    scene, whatever its volumes, serves again. Raises UsageError for a setting out of range, BakeError without a volume or
    geometry."""
    validate_settings(settings)
    if not scene.volumes:
        raise BakeError("the scene has no probe volume", "add a Light Probe Volume")
    seed = seed_of(rng)
    progress.stage("ray tracer")
    progress.step(0.0, "building the ray tracer")
    return context or LightContext(scene, threads), seed


def seed_of(rng: np.random.Generator) -> int:
    """The seed of a bake that is given ``rng``."""
    return int(rng.integers(1 << 32))


def volumes_by_settings(volumes: tuple[ProbeVolume, ...], settings) -> list[tuple[object, tuple[ProbeVolume, ...]]]:
    """Volumes grouped by their settings and by the light that they capture; a volume's own overrides replace those of the bake's
    ``settings``.

    Raises UsageError for an override out of range; those that the technique does not have are left aside.
    """
    groups: dict[tuple, list[ProbeVolume]] = {}
    known = {item.name for item in fields(settings)}
    for volume in volumes:
        of_volume = replace(settings, **{name: value for name, value in volume.settings.items() if name in known})
        validate_settings(of_volume)
        captured = volume.capture_world, volume.capture_emission, volume.capture_bounces, volume.intensity
        groups.setdefault((of_volume, None if volume.captures_all else captured), []).append(volume)
    return [(of_group, tuple(members)) for (of_group, _), members in groups.items()]


def all_captured(technique: str, volumes: tuple[ProbeVolume, ...]) -> tuple[Omission, ...]:
    """What ``technique`` omits that gives each of ``volumes`` all light as it is, whatever they are set to capture."""
    return tuple(Omission(f"{technique} gives volume {volume.name} all light as it is, whatever its Capture and Intensity say",
                          objects=(volume.name,), boxes_world=_box(volume)) for volume in volumes if not volume.captures_all)


def _box(volume: ProbeVolume) -> np.ndarray:
    corners = box_corners(volume.world_from_local)
    return np.stack([corners.min(axis=0), corners.max(axis=0)])[None]


class GridFacts:
    """What bundles and reports ask of the probes of one ``volume``, a number of each or a slice of all at a time: ``order`` (SH),
    ``fitted``, ``visibility_size`` T, and ``validity``, ``offset_world`` and ``standard_error`` as a ProbeGrid has them."""

    def coefficient(self, index: int) -> np.ndarray:
        """One SH coefficient (nz, ny, nx, 3) float32 of all probes."""
        raise NotImplementedError

    def visibility_slices(self, first: int, last: int) -> np.ndarray:
        """The tiles (last − first, ny, nx, T, T, 2) float32 of the slices from ``first`` up to ``last``."""
        raise NotImplementedError

    @property
    def usable(self) -> np.ndarray:
        """(nz, ny, nx) bool: probes whose coefficients were measured where they belong, outside geometry."""
        return (self.validity >= 1.0 - BACKFACE_THRESHOLD) & ~self.moved

    @property
    def moved(self) -> np.ndarray:
        """(nz, ny, nx) bool: probes that were moved from their lattice point; of scattered ones none, they stand where they
        should."""
        return np.any(self.offset_world != 0, axis=-1) & (self.volume.scattered is None)

    @property
    def counts(self) -> np.ndarray:
        """(nz, ny, nx) bool: probes of the volume; of a scattered one those that its list has, without what fills up its rows."""
        return (self.validity > 0.0) | (self.volume.scattered is None)

    @property
    def in_the_open(self) -> np.ndarray:
        """(nz, ny, nx) bool: probes that were measured, at their lattice point or moved out of geometry."""
        return (self.validity >= 1.0 - BACKFACE_THRESHOLD) | self.moved


@dataclass(frozen=True, eq=False)
class ProbeGrid(GridFacts):
    """The result for one volume; arrays are indexed [z, y, x] like the bundle's flipbooks.

    ``sh`` (nz, ny, nx, (L+1)², 3) float32: projection of incident radiance, world axes (docs/physics.md §1), as measured, or
    ``fitted`` with ``visibility`` to how they are read (docs/techniques/probes.md).
    ``validity`` (nz, ny, nx) float32: 1 usable, 0 inside geometry, between = share of front-facing hits, at the lattice point.
    ``visibility`` (nz, ny, nx, T, T, 2) float32: octahedral tile (row = y of the map) of mean distance [m] and mean squared
    distance [m²]. ``offset_world`` (nz, ny, nx, 3) float32: how far the probe was moved out of geometry [m], 0 where it was not.
    ``standard_error`` (nz, ny, nx) float32: estimated RMS error of a probe's coefficients as measured, in their unit; NaN where
    unknown.
    """

    volume: ProbeVolume
    sh: np.ndarray
    validity: np.ndarray
    visibility: np.ndarray
    offset_world: np.ndarray
    standard_error: np.ndarray
    fitted: bool = False

    @property
    def order(self) -> int:
        """SH order L."""
        return round(np.sqrt(self.sh.shape[3])) - 1

    @property
    def visibility_size(self) -> int:
        """See GridFacts."""
        return self.visibility.shape[3]

    def coefficient(self, index: int) -> np.ndarray:
        """See GridFacts."""
        return self.sh[:, :, :, index]

    def visibility_slices(self, first: int, last: int) -> np.ndarray:
        """See GridFacts."""
        return self.visibility[first:last]


# Above this share of hits on the inside of closed solids a probe counts as inside geometry (RTXGI-DDGI's default).
BACKFACE_THRESHOLD = 0.25


class Cause(IntEnum):
    """Why a receiver leaks; ``text`` says it to the user."""

    NONE = 0
    THIN_WALL = 1
    INSIDE = 2
    TWO_SIDED = 3
    NO_VISIBILITY = 4
    BETWEEN = 5

    @property
    def text(self) -> str:
        """What a panel shows."""
        return _TEXTS[self]


_TEXTS = {
    Cause.NONE: "no leak", Cause.THIN_WALL: "wall thinner than the spacing", Cause.INSIDE: "probe inside geometry",
    Cause.TWO_SIDED: "two-sided material", Cause.NO_VISIBILITY: "no visibility in the technique",
    Cause.BETWEEN: "light changes between samples",
}


class Field(ABC):
    """Indirect irradiance everywhere, as one technique knows it: view-independent and immutable.

    ``direct_lamps`` are the names of the lamps whose direct light is in it (None: all, by whatever names); ``params`` and ``stats``
    are JSON-able dictionaries; ``notes`` are lines for the user about this field of this scene, and ``omissions`` what of the scene
    it does not follow.
    """

    technique: str = ""
    direct_lamps: frozenset[str] | None = frozenset()
    notes: tuple[str, ...] = ()
    omissions: tuple[Omission, ...] = ()
    # What it makes of any light (techniques/transfer), if it knows.
    transfer = None
    # What sphere probes saw (effects/spheres/maps.py), if any were baked.
    spheres = None
    # Its light at the texels of objects' UV maps (effects/atlas/sheet.py), if any is in an atlas.
    atlas = None
    params: dict
    stats: dict

    @property
    def includes_direct(self) -> bool:
        """Whether any lamp's direct light is in it."""
        return self.direct_lamps is None or bool(self.direct_lamps)

    @abstractmethod
    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) [W·m⁻²] at ``points`` (n, 3) on surfaces with unit ``normals`` (n, 3), world space; never negative."""

    @abstractmethod
    def arrays(self) -> dict[str, np.ndarray]:
        """Everything needed to rebuild the field, by name."""

    def radiance_sh(self, points: np.ndarray, order: int = 2) -> np.ndarray:
        """SH coefficients (n, (order + 1)², 3) of the radiance that arrives at free ``points`` (n, 3), world axes: what a medium
        scatters and a dull mirror shows. Raises UsageError for an ``order`` beyond what the technique knows, which is 2 unless it
        says otherwise."""
        return radiance_from_irradiance(self, points, order)

    def grids(self) -> tuple[ProbeGrid, ...]:
        """The field as probe grids on the scene's volumes: what the bundle stores."""
        raise NotImplementedError(f"{type(self).__name__} has no probe grids")

    def leak_causes(self, context, points: np.ndarray, normals: np.ndarray, excess: np.ndarray) -> np.ndarray:
        """Why (n,) int8 of Cause there is ``excess`` luminance (n,) of irradiance at ``points`` (n, 3) under ``normals`` (n, 3) in
        the scene of ``context`` (a LightContext)."""
        return np.full(len(points), Cause.BETWEEN, np.int8)

    @property
    def live_settings(self):
        """The settings of the bake if its light is made of what is drawn, so that it follows objects without one; else None."""
        return None

    def stored_forms(self) -> tuple:
        """What it takes in the forms that it can be stored in, and what these lose (transfer/stored.py), if it has a choice."""
        return ()

    def light_volumes(self) -> "Field | None":
        """The field as light propagation volumes that engines read beside probes, if it has any."""
        return None

    def lit_voxels(self):
        """The field's voxels as engines trace cones through them (voxels/shipped.py), if it has any."""
        return None


# Irradiance is integrated exactly against SH of order 2 up to its own band 8: 66 normals.
QUADRATURE_DEGREE = 10
MAX_QUADRATURE_ORDER = 2


def require_order_of_irradiance(field: Field, order: int) -> None:
    """Raises UsageError for an ``order`` above 2, which irradiance does not tell: the cosine lobe has no band 3."""
    if order > MAX_QUADRATURE_ORDER:
        raise UsageError(f"order is {order}", f"{field.technique} knows irradiance only: choose an order from 0 to "
                                              f"{MAX_QUADRATURE_ORDER}")


def radiance_from_irradiance(field: Field, points: np.ndarray, order: int) -> np.ndarray:
    """What ``Field.radiance_sh`` is where irradiance is all that is known: its projection over normals, without the cosine lobe.

    Raises UsageError as ``require_order_of_irradiance``.
    """
    require_order_of_irradiance(field, order)
    normals, solid_angles = sh.quadrature(QUADRATURE_DEGREE)
    deconvolved = sh.evaluate(normals, order) * (solid_angles[:, None] / sh.cosine_coefficients(order))
    irradiance = field.irradiance(np.repeat(points, len(normals), axis=0), np.tile(normals.astype(np.float32), (len(points), 1)))
    return np.einsum("pnc,nk->pkc", irradiance.reshape(len(points), len(normals), 3), deconvolved)


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


# The largest side of a texture that the GPUs and engines we write for all accept.
MAX_TEXTURE_SIDE = 16384

# From quick to exact. A technique without a preset keeps its settings.
PRESETS = ("draft", "preview", "final")

# What indirect irradiance is made of (docs/physics.md §1).
KNOWN_LIGHT = frozenset({"lamps", "emissive surfaces", "world", "bounces"})


class Common(NamedTuple):
    """What all blocks of a bake have in common: ``arrays`` by name; what the finished field is held to (``truth``, arrays by name);
    world positions (n, 3) of the ``usable`` probes, and for each volume the share of those ``in_the_open`` (ProbeGrid);
    ``direct_lamps`` and ``notes`` as of the finished Field; the number of ``blocks``."""

    arrays: dict[str, np.ndarray]
    truth: dict[str, np.ndarray]
    usable: np.ndarray
    in_the_open: tuple[float, ...]
    direct_lamps: frozenset[str]
    blocks: int
    notes: tuple[str, ...] = ()


class BakeBlocks(Protocol):
    """A bake that is ready to be made block by block, ``count`` of them. A block gives the same bytes wherever it is made."""

    count: int

    def bake(self, index: int, progress: Progress) -> dict[str, np.ndarray]:
        """What the block ``index`` holds, by name. Raises BakeError, Cancelled."""


class Blocks(Protocol):
    """How a technique's bake is cut into blocks of probes."""

    def refusal(self, settings) -> str:
        """Why a bake with ``settings`` cannot be cut, as the end of a sentence; "" if it can."""

    def prepare(self, scene: Scene, settings, rng: np.random.Generator, progress: Progress,
                threads: int | None = None) -> Common:
        """All that a bake of ``scene`` has in common. Raises as ``Technique.bake``."""

    def begin(self, scene: Scene, settings, rng: np.random.Generator, arrays: Mapping[str, np.ndarray],
              threads: int | None = None) -> BakeBlocks:
        """The blocks of a bake that was prepared, in the ``arrays`` of ``prepare``; ``rng`` as it was given to that."""

    def field(self, volumes: tuple[ProbeVolume, ...], settings, read: Callable[[int, str], np.ndarray],
              direct_lamps: frozenset[str] | None, truth: Mapping[str, np.ndarray]) -> Field:
        """The finished field of all blocks, of which ``read(index, name)`` gives an array, held to the ``truth`` of ``prepare``.
        Its grids are asked for no more than GridFacts until somebody asks for light."""


class Technique(ABC):
    """One GI technique: a name, a frozen ``Settings`` dataclass, and ``bake``.

    ``tolerance`` is the relative error of irradiance that it declares for scenes with a closed form, at default settings;
    ``knows`` names the light in its fields, of KNOWN_LIGHT; without "bounces" they hold the first bounce of it. ``devices`` says
    where it can bake; one that knows "gpu" takes ``kernels`` in its ``bake`` (techniques/kernels.py). ``lattices`` are factors of
    the volumes' resolution at which a chart measures its defaults as well, if its field lives on the lattice. ``presets`` holds, by
    name (of PRESETS), the settings that decide what quality costs; all of them name the same ones. ``follows_media`` says whether
    what media take, give and scatter is in its fields. ``not_weighed`` says why a plan for the light as it is need not measure it,
    for a technique that cannot be the cheaper one. ``blocks`` (None: its bake is one piece) cuts a
    bake into parts that know nothing of each other. ``transfers`` says that its probes are lit anew without a bake.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    description: ClassVar[str]
    Settings: ClassVar[type]
    tolerance: ClassVar[float] = 0.02
    knows: ClassVar[frozenset[str]] = KNOWN_LIGHT
    devices: ClassVar[tuple[str, ...]] = ("cpu",)
    lattices: ClassVar[tuple[float, ...]] = ()
    follows_media: ClassVar[bool] = False
    not_weighed: ClassVar[str] = ""
    transfers: ClassVar[bool] = False
    presets: ClassVar[dict[str, dict]] = {}
    blocks: ClassVar[Blocks | None] = None

    @abstractmethod
    def bake(self, scene: Scene, settings, rng: np.random.Generator, progress: Progress, *, threads: int | None = None,
             checkpoint: Checkpoint | None = None) -> Field:
        """Bake every volume of ``scene``. The same ``rng`` seed gives the same bytes for any number of ``threads``
        (None = every core). Raises BakeError for what the user can mend, Cancelled when asked to stop."""

    def sweep(self) -> tuple:
        """Settings from cheap to dear that a chart of speed against accuracy measures, the defaults among them."""
        return (self.Settings(),)
