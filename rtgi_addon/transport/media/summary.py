"""Media in a few numbers, for whoever wants to see what was found of them."""

from dataclasses import dataclass

import numpy as np

from ...scene import Medium
from ..vectors import luminance
from .grid import GridTable
from .phase import phase_moments


@dataclass(frozen=True)
class MediumFound:
    """``mean_free_path`` [m]: how far light gets on average before it is absorbed or scattered (infinite: it is not), at the
    densest place where the medium differs from place to place (``varies``); ``albedo``, the share that is scattered of what does
    not get through, and the mean cosine ``g`` of the angle by which it turns; whether it ``glows``."""

    name: str
    mean_free_path: float
    albedo: float
    g: float
    varies: bool
    glows: bool


def found_media(media: tuple[Medium, ...]) -> tuple[MediumFound, ...]:
    """All of ``media``, by luminance."""
    return tuple(map(_found, media))


def _found(medium: Medium) -> MediumFound:
    scattering, extinction = (float(luminance(np.asarray(part, np.float64))) for part in (medium.scattering, medium.extinction))
    densest = extinction if medium.grid is None else float(luminance(GridTable(medium).majorant))
    return MediumFound(medium.name, 1.0 / densest if densest > 0 else float("inf"),
                       scattering / extinction if extinction > 0 else 0.0, float(phase_moments(medium.phase, 1)[1]),
                       medium.grid is not None, medium.is_emissive)
