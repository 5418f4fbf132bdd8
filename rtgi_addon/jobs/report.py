"""What a bake did, for people and for programs."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ..exchange.plain import plain
from ..scene import Scene
from ..techniques import Field, ProbeGrid


@dataclass(frozen=True)
class VolumeSummary:
    """One volume: how many probes of how many are usable, and the estimated relative RMSE of their SH coefficients
    (FORMATS.md: against the limit of infinitely many rays; None where the technique does not estimate it)."""

    name: str
    resolution: tuple[int, int, int]
    probes: int
    usable: int
    moved: int
    sh_order: int
    estimated_error: float | None
    fitted: bool


@dataclass(frozen=True)
class BakeSummary:
    """A finished bake; ``seconds`` maps each stage to its wall-clock time; ``picture`` is the PNG that was drawn, if one was."""

    out: Path
    technique: str
    settings: dict
    seed: int
    volumes: tuple[VolumeSummary, ...]
    includes_direct: bool
    rays: int
    seconds: dict[str, float]
    peak_memory_bytes: int
    resumed: bool
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    stats: dict
    picture: Path | None = None

    def to_json(self) -> dict:
        """The summary as JSON-able values."""
        return plain({**asdict(self), "out": str(self.out), "picture": self.picture and str(self.picture)})

    def to_text(self) -> str:
        """The summary as lines for a person."""
        total = sum(self.seconds.values())
        rate = f", {self.rays / total / 1e6:.1f} million a second" if total > 0 and self.rays > 1e5 * total else ""
        stages = ", ".join(f"{name} {seconds:.2f}" for name, seconds in self.seconds.items() if seconds >= 0.005)
        return "\n".join([
            f"Baked {self.out} with {self.technique}, seed {self.seed}" + (" (resumed)" if self.resumed else ""),
            *(volume_line(volume) for volume in self.volumes),
            f"  rays     {self.rays:,}{rate}",
            f"  seconds  {total:.2f} ({stages})",
            f"  memory   {self.peak_memory_bytes / 2**20:,.0f} MiB at most",
            *([f"  picture  {self.picture}"] if self.picture else []),
            *(f"  note     {note}" for note in self.notes),
            *(f"  warning  {warning}" for warning in self.warnings),
        ])


def summarize(field: Field, scene: Scene, *, out: Path, technique: str, settings: dict, seed: int, warnings, resumed: bool,
              stats: dict) -> BakeSummary:
    """The summary of the bake of ``scene`` that gave ``field``."""
    return BakeSummary(
        out=out, technique=technique, settings=settings, seed=seed,
        volumes=tuple(volume_summary(grid) for grid in field.grids()),
        includes_direct=bool(field.includes_direct), rays=int(stats["rays"]), seconds=stats["seconds"],
        peak_memory_bytes=stats["peak_memory_bytes"], resumed=resumed, warnings=tuple(warnings), notes=(*scene.notes, *field.notes),
        stats={name: value for name, value in stats.items() if name not in ("rays", "seconds", "peak_memory_bytes")})


def volume_summary(grid: ProbeGrid) -> VolumeSummary:
    """Counts and estimated error of one volume."""
    moved = np.any(grid.offset_world != 0, axis=-1)
    return VolumeSummary(
        name=grid.volume.name, resolution=tuple(int(n) for n in grid.volume.resolution), probes=int(grid.validity.size),
        usable=int(grid.usable.sum()), moved=int(moved.sum()), sh_order=grid.order, estimated_error=estimated_error(grid),
        fitted=bool(grid.volume.fitted))


def estimated_error(grid: ProbeGrid) -> float | None:
    """RMS standard error of the usable probes' coefficients over their RMS value; None where it is not known."""
    usable = grid.usable & np.isfinite(grid.standard_error)
    if not usable.any():
        return None
    energy = np.mean(np.square(grid.sh[usable], dtype=np.float64))
    variance = np.mean(np.square(grid.standard_error[usable], dtype=np.float64))
    return float(np.sqrt(variance / energy)) if energy > 0 else (0.0 if variance == 0 else None)


def volume_line(volume: VolumeSummary) -> str:
    """One line about a volume, for a person."""
    size = " × ".join(map(str, volume.resolution))
    share = 100.0 * volume.usable / volume.probes
    parts = [f"{size} probes", f"order {volume.sh_order}", f"{share:.1f} % usable"]
    if volume.moved:
        parts.append(f"{volume.moved} moved out of geometry")
    if volume.estimated_error is not None:
        parts.append(f"estimated error {100.0 * volume.estimated_error:.2g} %")
    if volume.fitted:
        parts.append("fitted to the scene")
    return f"  {volume.name}: " + ", ".join(parts)
