"""`info`: check and print a bundle."""

import argparse
from dataclasses import asdict, dataclass

import numpy as np

from ...exchange.bundle import Bundle, read_bundle
from ...exchange.plain import plain
from ...jobs.report import volume_line, volume_summary
from .base import Session, Subcommand


@dataclass(frozen=True)
class BundleReport:
    """A bundle that was found whole, and what is in it."""

    bundle: Bundle

    def to_json(self) -> dict:
        """Path, manifest and what was counted in each volume."""
        volumes = [{**asdict(volume_summary(grid)), **_light(grid)} for grid in self.bundle.grids]
        return plain({"bundle": str(self.bundle.path), "manifest": self.bundle.manifest, "volumes": volumes})

    def to_text(self) -> str:
        """The same as lines for a person."""
        manifest = self.bundle.manifest
        settings = ", ".join(f"{name} {value}" for name, value in manifest["settings"].items() if value is not None)
        lines = [
            f"{self.bundle.path} is whole: {len(manifest['sha256'])} files, {manifest['schema']}",
            f"  scene      {manifest['scene']} (Blender {manifest['blender']}, rtgi {manifest['rtgi']})",
            f"  technique  {manifest['technique']}, seed {manifest['seed']}: {settings}",
            f"  light      {'direct and indirect' if manifest.get('includes_direct') else 'indirect only'}",
        ]
        for grid in self.bundle.grids:
            light = _light(grid)
            lines.append(f"{volume_line(volume_summary(grid))}, mean radiance {light['mean_radiance']:.4g}, "
                         f"brightest {light['peak_radiance']:.4g} W/(sr m²)")
        return "\n".join(lines + [f"  note       {note}" for note in manifest.get("notes", [])])


def _light(grid) -> dict[str, float]:
    """Mean and largest mean radiance over the sphere of the usable probes [W·sr⁻¹·m⁻²], averaged over RGB."""
    if not grid.usable.any():
        return {"mean_radiance": 0.0, "peak_radiance": 0.0}
    mean = grid.sh[grid.usable][:, 0].mean(axis=1) * np.sqrt(1.0 / (4.0 * np.pi))
    return {"mean_radiance": float(mean.mean()), "peak_radiance": float(mean.max())}


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bundle", metavar="BUNDLE", help="the folder that `bake --out` wrote")


def _run(arguments: argparse.Namespace, session: Session) -> BundleReport:
    return BundleReport(read_bundle(arguments.bundle))


SUBCOMMAND = Subcommand("info", "check and print a bundle", False, _add_arguments, _run)
