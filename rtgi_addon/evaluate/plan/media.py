"""Whether the media of a scene matter for its light, and how fine probes would have to be to follow light within them."""

from dataclasses import dataclass, replace

import numpy as np

from ...effects.media import MediaSettings
from ...numerics.grid import cell_size
from ...numerics.sampling import fibonacci_sphere
from ...scene import ProbeVolume
from ...transport.context import LightContext
from ...transport.paths.reference import irradiance_at
from ...transport.vectors import luminance
from .pictures import media_detail
from .sample import Sample

# Receivers and paths from each that tell what media change of the light; looks from each of some probes that tell what they take.
RECEIVERS, PATHS, EYES, RAYS = 64, 64, 64, 32
# The change of light at surfaces from which on media matter.
MATTERS = 0.01
# Standard errors that a change must be clear of.
_CLEAR = 2.0
# Cells along a side that a plan would advise at most.
_MOST_CELLS = 256


@dataclass(frozen=True)
class MediaLook:
    """``names`` of media; ``change`` of the light at surfaces that they make, lamps' own included, of what there would be without
    them, and its standard ``error``; ``taken``, the mean share of light that they take along what probes see. ``free_path`` [m]
    is the shortest mean free path of light in one that scatters (``densest``), ``spacing`` [m] the widest cell side of the lattices
    and ``fine`` the resolutions with cells no wider than the path, or None where those of the file are as fine. ``detail`` are the
    pixels of a column and the slices that follow them in the camera's picture; None where none is seen there."""

    names: tuple[str, ...]
    change: float
    error: float
    taken: float
    free_path: float | None
    densest: str
    spacing: float
    fine: tuple[tuple[int, int, int], ...] | None
    detail: tuple[int, int] | None = None

    @property
    def matters(self) -> bool:
        """Whether light at surfaces is another by them."""
        return abs(self.change) + _CLEAR * self.error > MATTERS


def look_at_media(context: LightContext, volumes: tuple[ProbeVolume, ...], sample: Sample, seed: int) -> MediaLook | None:
    """What the media of ``context`` do to the light of ``sample``'s receivers; None without media."""
    fillings = context.all_media.fillings
    if not fillings:
        return None
    names = tuple(dict.fromkeys(filling.medium.name for filling in fillings))
    clear = LightContext(replace(context.scene, media=()), context.threads)
    rows = np.unique(np.linspace(0, len(sample.receivers.points) - 1, RECEIVERS).astype(int))
    at = sample.receivers.points[rows], sample.receivers.normals[rows]
    found, without = (irradiance_at(each, *at, PATHS, seed=seed, direct=True) for each in (context, clear))
    sums = [float(luminance(each.mean).sum()) for each in (found, without)]
    errors = [float(np.sqrt(np.sum(luminance(each.standard_error) ** 2))) for each in (found, without)]
    change, error = 0.0, 0.0
    if sums[1] > 0:
        change = sums[0] / sums[1] - 1.0
        error = float(np.hypot(errors[0], (1.0 + change) * errors[1])) / sums[1]
    elif sums[0] > 0:
        change = np.inf
    eyes = sample.eyes[np.unique(np.linspace(0, len(sample.eyes) - 1, EYES).astype(int))]
    origins, directions = np.repeat(eyes, RAYS, axis=0), np.tile(fibonacci_sphere(RAYS), (len(eyes), 1))
    reach = context.bare.view.intersect(origins.astype(np.float32), directions).t
    taken = 1.0 - float(context.all_media.transmittance(origins, directions, reach).mean())
    paths = {filling.medium.name: 1.0 / filling.majorant.mean() for filling in fillings
             if np.any(np.asarray(filling.medium.scattering) > 0) and filling.majorant.mean() > 0}
    densest = min(paths, key=paths.get) if paths else ""
    spacing = max(float(cell_size(volume.world_from_local, volume.resolution).max()) for volume in volumes)
    fine = None
    if paths and spacing > paths[densest]:
        fine = tuple(_fine(volume, paths[densest]) for volume in volumes)
    return MediaLook(names, change, error, taken, paths.get(densest), densest, spacing, fine,
                     media_detail(context.scene, fillings))


def sentences(look: MediaLook) -> list[str]:
    """What a person should know of it."""
    names = ", ".join(look.names)
    if np.isinf(look.change):
        lines = [f"All light is that of media ({names})."]
    elif look.matters:
        lines = [f"Media ({names}) change light at surfaces by {100 * look.change:+.0f} % (+- {100 * look.error:.1g}), and take "
                 f"{100 * look.taken:.0f} % along what probes see: the bake follows them."]
    else:
        lines = [f"Media ({names}) hardly matter for light at surfaces, {100 * look.change:+.1f} % (+- {100 * look.error:.1g}): "
                 "hidden from renders they save the bake up to two thirds of its rays, and leave the picture as well."]
    if look.fine is not None:
        cells = ", ".join(" x ".join(map(str, resolution)) for resolution in look.fine)
        lines.append(f"Light scattered within {look.densest} changes over its mean free path, {look.free_path:.2g} m where it is "
                     f"densest, and probes are up to {look.spacing:.2g} m apart: in the air {cells} would follow it, and in "
                     "pictures rays (--set media.rays=1) do without. The plan is for surfaces alone.")
    if look.detail is not None and look.detail != (MediaSettings.tile, MediaSettings.slices):
        tile, slices = look.detail
        lines.append(f"In the camera's picture media are followed by columns of {tile} pixel{'s' * (tile > 1)} in {slices} slices: "
                     f"--set media.tile={tile} --set media.slices={slices}.")
    return lines


def _fine(volume: ProbeVolume, path: float) -> tuple[int, int, int]:
    """The resolution of ``volume`` whose cells are no wider than ``path``, as far as that is sane."""
    sides = cell_size(volume.world_from_local, volume.resolution) * np.asarray(volume.resolution)
    wanted = np.maximum(np.ceil(sides / path - 1e-6), volume.resolution)
    return tuple(int(count) for count in np.minimum(wanted, _MOST_CELLS))
