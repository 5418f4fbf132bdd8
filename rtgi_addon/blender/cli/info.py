"""`info`: check and print a bundle."""

import argparse
from dataclasses import asdict, dataclass

import numpy as np

from ...effects.spheres.prefilter import averaged
from ...exchange.bundle import Bundle, read_bundle
from ...exchange.plain import plain
from ...exchange.roles import light_text
from ...exchange.series import Series, is_series, read_series
from ...exchange.transfer_files import read_index
from ...jobs.report import surface_line, volume_line, volume_summary
from ...jobs.series import frames_text
from ...techniques.transfer.columns import GROUP
from ...words import as_lines
from .base import Session, Subcommand


@dataclass(frozen=True)
class BundleReport:
    """A bundle that was found whole, and what is in it."""

    bundle: Bundle

    def to_json(self) -> dict:
        """Path, manifest and what was counted in each volume."""
        volumes = [{**asdict(volume_summary(grid)), **_light(grid)} for grid in self.bundle.grids]
        return plain({"bundle": str(self.bundle.path), "manifest": self.bundle.manifest, "volumes": volumes,
                      "unchecked": self.bundle.unchecked, "transfer": self.transfer, "spheres": self.spheres,
                      "atlas": self.atlas})

    @property
    def transfer(self) -> dict | None:
        """What its transfer holds, if it has any."""
        return read_index(self.bundle.path) if "transfer" in self.bundle.manifest else None

    def _transfer_lines(self) -> list[str]:
        index = self.transfer
        if index is None:
            return []
        suns = index["sun_side"] ** 2 * (1 + index["sun_below"])
        groups = [light["name"] for light in index["lights"] if light["kind"] == GROUP]
        rounding = f", rounded to 16 bits (off by {100.0 * index['half_error']:.2g} %)" if index["half"] else ""
        vectors = index.get("vectors")
        by = f" by {vectors['count']} vectors (off by {100.0 * vectors['error']:.2g} %)" if vectors else ""
        return [f"{index['bytes_per_probe']:,} bytes a probe{rounding}",
                f"sky of order {index['sky_order']}, {suns} directions of the sun{by}, {len(index['sites'])} lamp sites",
                f"groups of lights: {', '.join(groups) or 'none'}"]

    @property
    def spheres(self) -> list[dict]:
        """Its sphere probes: name, texels, influence, and the mean and the largest radiance that arrives at them [W·sr⁻¹·m⁻²]."""
        found = () if self.bundle.spheres is None else self.bundle.spheres.maps
        return [{"name": item.probe.name, "resolution": item.resolution, "influence": item.probe.influence_shape,
                 "distance": item.probe.influence_distance, "parallax": item.probe.parallax_shape,
                 "mean_radiance": float(averaged(item.levels[0][None], 1).mean()),
                 "peak_radiance": float(item.levels[0].max())} for item in found]

    def _sphere_lines(self) -> list[str]:
        return [f"{found['name']}: {found['resolution']} × {found['resolution']} texels, influence {found['influence']} of "
                f"{found['distance']:g} m, parallax {found['parallax']}, mean radiance {found['mean_radiance']:.4g}, brightest "
                f"{found['peak_radiance']:.4g} W/(sr m²)" for found in self.spheres]

    @property
    def atlas(self) -> dict | None:
        """Its light atlas: texels across and down, those that are known, and of each object its UV map and its share of them."""
        atlas = self.bundle.atlas
        if atlas is None:
            return None
        height, width = atlas.sheet.size
        return {"width": width, "height": height, "known": int(atlas.known.sum()),
                "follows": _followed(atlas.transfer),
                "mean_irradiance": float(atlas.irradiance[atlas.known].mean()) if atlas.known.any() else 0.0,
                "objects": [{"name": part.name, "uv_map": part.uv_map, "width": part.width, "height": part.height}
                            for part in atlas.sheet.parts]}

    def _atlas_lines(self) -> list[str]:
        found = self.atlas
        if found is None:
            return []
        objects = ", ".join(f"{entry['name']} ({entry['uv_map']}, {entry['width']} × {entry['height']})"
                            for entry in found["objects"])
        lines = [f"{found['width']} × {found['height']} texels, {found['known']:,} of them on surfaces, mean irradiance "
                 f"{found['mean_irradiance']:.4g} W/m²: {objects}"]
        return lines if found["follows"] is None else [*lines, f"follows {found['follows']}"]

    def to_text(self) -> str:
        """The same as lines for a person."""
        manifest = self.bundle.manifest
        settings = ", ".join(f"{name} {value}" for name, value in manifest["settings"].items() if value is not None)
        lines = [
            f"{self.bundle.path} is whole: {len(manifest['sha256'])} files, {manifest['schema']}",
            f"  scene      {manifest['scene']} (Blender {manifest['blender']}, rtgi {manifest['rtgi']})",
            f"  technique  {manifest['technique']}, seed {manifest['seed']}: {settings}",
            f"  light      {light_text(manifest.get('lamps', {}), bool(manifest.get('includes_direct')))}",
            *([f"  dynamic    {', '.join(manifest['objects'])}"] if manifest.get("objects") else []),
        ]
        for grid in self.bundle.grids:
            light = _light(grid)
            lines.append(f"{volume_line(volume_summary(grid))}, mean radiance {light['mean_radiance']:.4g}, "
                         f"brightest {light['peak_radiance']:.4g} W/(sr m²)")
        lines += [f"  transfer   {line}" for line in self._transfer_lines()]
        lines += [f"  sphere     {line}" for line in self._sphere_lines()]
        lines += [f"  atlas      {line}" for line in self._atlas_lines()]
        error = manifest["stats"].get("error_on_surfaces")
        lines += [f"  surfaces   {surface_line(error)}"] if error else []
        lines += [f"  omitted    {entry['text']}" for entry in manifest.get("not_followed", [])]
        return as_lines(lines + [f"  note       {note}" for note in (*manifest.get("notes", ()), *self.bundle.unchecked)])


@dataclass(frozen=True)
class SeriesReport:
    """A series whose bundles were found whole, and what it holds."""

    series: Series
    bundles: tuple[Bundle, ...]

    def to_json(self) -> dict:
        """Path, frames, and what is in each bundle."""
        series, there = self.series, self._there
        return plain({
            "series": str(series.path), "scene": series.scene, "technique": series.technique, "settings": series.settings,
            "seed": series.seed, "first": series.first, "last": series.last, "step": series.step,
            "frames_per_second": series.frames_per_second, "missing": [frame for frame in series.wanted if frame not in there],
            "frames": [{"frame": entry.frame, "bundle": entry.bundle} for entry in series.frames],
            "bundles": {bundle.path.name: BundleReport(bundle).to_json() for bundle in self.bundles}})

    @property
    def _there(self) -> set[int]:
        return {entry.frame for entry in self.series.frames}

    def to_text(self) -> str:
        """The same as lines for a person."""
        series, missing = self.series, [frame for frame in self.series.wanted if frame not in self._there]
        size = sum(sum(bundle.manifest.get("bytes", {}).values()) for bundle in self.bundles)
        lines = [
            f"{series.path} is whole: {len(series.frames)} frames in {len(self.bundles)} bundles of {size / 2**20:.1f} MiB",
            f"  scene      {series.scene}, {series.frames_per_second:g} frames a second",
            f"  technique  {series.technique}, seed {series.seed}",
            f"  frames     {frames_text([entry.frame for entry in series.frames])}",
            *([f"  missing    {frames_text(missing)}: bake with --resume"] if missing else []),
        ]
        for bundle in self.bundles:
            light = [_light(grid)["mean_radiance"] for grid in bundle.grids]
            lines.append(f"  {bundle.path.name}: mean radiance {', '.join(f'{value:.4g}' for value in light)} W/(sr m²)")
        return as_lines(lines)


def _followed(transfer) -> str | None:
    """What of other light an atlas with that ``transfer`` (None: none) follows."""
    if transfer is None:
        return None
    suns = f", {transfer.suns.shape[-1]} directions of the sun" if transfer.follows_suns else ""
    return f"{transfer.lights.shape[-1]} lights of the bake, a sky of order {transfer.sky_order}{suns}"


def _light(grid) -> dict[str, float]:
    """Mean and largest mean radiance over the sphere of the usable probes [W·sr⁻¹·m⁻²], averaged over RGB."""
    if not grid.usable.any():
        return {"mean_radiance": 0.0, "peak_radiance": 0.0}
    mean = grid.sh[grid.usable][:, 0].mean(axis=1) * np.sqrt(1.0 / (4.0 * np.pi))
    return {"mean_radiance": float(mean.mean()), "peak_radiance": float(mean.max())}


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bundle", metavar="BUNDLE", help="the folder that `bake --out` wrote, of a series too")


def _run(arguments: argparse.Namespace, session: Session) -> BundleReport | SeriesReport:
    if is_series(arguments.bundle):
        series = read_series(arguments.bundle)
        count = len(series.bundles)
        return SeriesReport(series, tuple(read_bundle(path, session.progress.span(index / count, (index + 1) / count))
                                          for index, path in enumerate(series.bundles)))
    return BundleReport(read_bundle(arguments.bundle, session.progress))


SUBCOMMAND = Subcommand("info", "check and print a bundle", False, _add_arguments, _run)
