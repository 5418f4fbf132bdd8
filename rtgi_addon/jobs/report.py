"""What a bake did, for people and for programs."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from ..evaluate.concerns import Concern
from ..exchange.plain import plain
from ..exchange.roles import INDIRECT_ONLY, lamp_roles, light_text, object_roles
from ..exchange.schema import FITTED, MEASURED
from ..scene import Scene
from ..scene.checks import Finding
from ..techniques import Field
from ..techniques.base import GridFacts
from ..words import as_lines

# From which error on surfaces on a bake is called wrong, and how many times that of the noise it must be for the lattice to blame.
WRONG, NOT_BY_NOISE = 0.1, 3.0


@dataclass(frozen=True)
class VolumeSummary:
    """One volume: how many probes of how many are usable, the estimated relative RMSE of their SH coefficients as they were
    measured (docs/physics.md §4: against infinitely many rays of the same bake; None where the technique does not estimate it), and
    whether those that are stored are measured or fitted. Of ``scattered`` ones ``resolution`` is that of the nodes that name
    them."""

    name: str
    resolution: tuple[int, int, int]
    probes: int
    usable: int
    moved: int
    sh_order: int
    estimated_error: float | None
    fitted: bool
    coefficients: str
    scattered: bool = False


@dataclass(frozen=True)
class BakeSummary:
    """A finished bake; ``seconds`` maps each stage to its wall-clock time; ``not_followed`` is what the file holds and the bake
    does not follow, with how much light that concerns; ``picture`` is the PNG that was drawn, if one was. ``lamps`` and ``objects``
    say by name what those are to the bake (exchange.roles); ``findings`` are those of the ``warnings`` that are about objects."""

    out: Path
    technique: str
    settings: dict
    seed: int
    volumes: tuple[VolumeSummary, ...]
    includes_direct: bool
    lamps: dict[str, str]
    objects: dict[str, str]
    rays: int
    seconds: dict[str, float]
    peak_memory_bytes: int
    resumed: bool
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    not_followed: tuple[Concern, ...]
    stats: dict
    picture: Path | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def error_on_surfaces(self) -> dict | None:
        """How far light that is read on surfaces is off, as ``surface_line`` takes it; None where the technique does not say."""
        return self.stats.get("error_on_surfaces")

    def to_json(self) -> dict:
        """The summary as JSON-able values."""
        values = asdict(replace(self, findings=()))
        del values["findings"]
        return plain({**values, "out": str(self.out), "picture": self.picture and str(self.picture),
                      "not_followed": [concern.to_json() for concern in self.not_followed]})

    def to_text(self) -> str:
        """The summary as lines for a person."""
        total = sum(self.seconds.values())
        rate = f", {self.rays / total / 1e6:.1f} million a second" if total > 0 and self.rays > 1e5 * total else ""
        light = light_text(self.lamps, self.includes_direct)
        stages = ", ".join(f"{name} {seconds:.2f}" for name, seconds in self.seconds.items() if seconds >= 0.005)
        return as_lines([
            f"Baked {self.out} with {self.technique}, seed {self.seed}" + (" (resumed)" if self.resumed else ""),
            *(volume_line(volume) for volume in self.volumes),
            *([f"  light    {light}"] if light != INDIRECT_ONLY else []),
            *([f"  dynamic  {', '.join(self.objects)}"] if self.objects else []),
            *([f"  surfaces {surface_line(self.error_on_surfaces)}"] if self.error_on_surfaces else []),
            f"  rays     {self.rays:,}{rate}",
            f"  seconds  {total:.2f} ({stages})",
            f"  memory   {self.peak_memory_bytes / 2**20:,.0f} MiB at most",
            *([f"  picture  {self.picture}"] if self.picture else []),
            *(f"  note     {note}" for note in self.notes),
            *(f"  omitted  {concern}" for concern in self.not_followed),
            *(f"  warning  {warning}" for warning in self.warnings),
        ])


def summarize(field: Field, scene: Scene, *, out: Path, technique: str, settings: dict, seed: int, warnings, resumed: bool,
              stats: dict, not_followed: tuple[Concern, ...] = (), findings: tuple[Finding, ...] = ()) -> BakeSummary:
    """The summary of the bake of ``scene`` that gave ``field``."""
    return BakeSummary(
        out=out, technique=technique, settings=settings, seed=seed,
        volumes=tuple(volume_summary(grid) for grid in field.grids()),
        includes_direct=bool(field.includes_direct), lamps=lamp_roles(scene, field), objects=object_roles(scene),
        rays=int(stats["rays"]), seconds=stats["seconds"],
        peak_memory_bytes=stats["peak_memory_bytes"], resumed=resumed, warnings=tuple(warnings), notes=(*scene.notes, *field.notes),
        not_followed=not_followed, findings=findings,
        stats={name: value for name, value in stats.items() if name not in ("rays", "seconds", "peak_memory_bytes")})


def volume_summary(grid: GridFacts) -> VolumeSummary:
    """Counts and estimated error of one volume."""
    return VolumeSummary(
        name=grid.volume.name, resolution=tuple(int(n) for n in grid.volume.nodes), probes=int(grid.counts.sum()),
        usable=int(grid.usable.sum()), moved=int(grid.moved.sum()), sh_order=grid.order, estimated_error=estimated_error(grid),
        fitted=bool(grid.volume.fitted), coefficients=FITTED if grid.fitted else MEASURED,
        scattered=grid.volume.scattered is not None)


def estimated_error(grid: GridFacts) -> float | None:
    """RMS standard error of the usable probes' coefficients over their RMS value; None where it is not known."""
    usable = grid.usable & np.isfinite(grid.standard_error)
    if not usable.any():
        return None
    energy = np.mean([np.mean(np.square(grid.coefficient(index)[usable], dtype=np.float64))
                      for index in range((grid.order + 1) ** 2)])
    variance = np.mean(np.square(grid.standard_error[usable], dtype=np.float64))
    return float(np.sqrt(variance / energy)) if energy > 0 else (0.0 if variance == 0 else None)


def surface_line(error: dict) -> str:
    """The ``error_on_surfaces`` of a bake's statistics (techniques/probes/surface_error.py), for a person."""
    value, low, high = (f"{100.0 * error[name]:.2g}" for name in ("value", "low", "high"))
    return f"light read on them off by {value} % ({low} to {high} %, {error['points']} points)"


def lattice_warning(field: Field) -> str | None:
    """What to do where light on surfaces is wrong and noise is not why; None where it is right, or noise is."""
    error = field.stats.get("error_on_surfaces")
    if error is None or error["low"] < WRONG:
        return None
    noise = max((estimated_error(grid) or 0.0 for grid in field.grids()), default=0.0)
    if error["low"] < NOT_BY_NOISE * noise:
        return None
    value, noise = (f"{100.0 * part:.2g} %" for part in (error["value"], noise))
    if any(grid.volume.scattered is not None for grid in field.grids()):
        return (f"light on surfaces is off by some {value}, and noise at the probes ({noise}) is not why, they lie too far apart: "
                "thin them less (--set scatter.error=0.02, Thinning), or give the volume a higher resolution")
    if all(grid.fitted for grid in field.grids()):
        return (f"light on surfaces is off by some {value}, and noise at the probes ({noise}) is not why, they lie too far apart: "
                "have a finer lattice planned (rtgi plan, Plan Bake)")
    if field.stats.get("near_emitters", {}).get("at_pixels"):
        return (f"light on surfaces is off by some {value}, and noise at the probes ({noise}) is not why, they lie too far apart: "
                "fit them to surfaces (--fit, Fit to Surfaces; RTGI's pictures then no longer draw what glows close by at each "
                "pixel), or have a finer lattice planned (rtgi plan, Plan Bake)")
    return (f"light on surfaces is off by some {value}, and noise at the probes ({noise}) is not why, they lie too far apart: "
            "fit them to surfaces (--fit, Fit to Surfaces), or have a finer lattice planned (rtgi plan, Plan Bake)")


def volume_line(volume: VolumeSummary) -> str:
    """One line about a volume, for a person."""
    size = " × ".join(map(str, volume.resolution))
    share = 100.0 * volume.usable / volume.probes
    probes = f"{volume.probes:,} scattered probes, named by {size} nodes" if volume.scattered else f"{size} probes"
    parts = [probes, f"order {volume.sh_order}", f"{share:.1f} % usable"]
    if volume.moved:
        parts.append(f"{volume.moved} moved out of geometry")
    if volume.estimated_error is not None:
        parts.append(f"noise at probes {100.0 * volume.estimated_error:.2g} %")
    if volume.fitted:
        parts.append("fitted to the scene")
    if volume.coefficients == FITTED:
        parts.append("light fitted to how it is read")
    return f"  {volume.name}: " + ", ".join(parts)
