"""What a bake of transfer leaves: for every probe, what it makes of any light."""

from dataclasses import dataclass, field

import numpy as np

from ...numerics import dome
from ...scene import World
from ..base import ProbeGrid


@dataclass(frozen=True, eq=False)
class TransferGrid:
    """The transfer of one volume's probes to their SH coefficients, k of them.

    ``grid`` is the light as it was baked. The matrices, all float32: ``sky`` (nz, ny, nx, k, S) takes the sky's coefficients to
    what of the sky the probe sees, without colour; the others have red, green and blue first: ``bounce`` (3, nz, ny, nx, k, S)
    what surfaces reflect of it; ``suns`` (3, nz, ny, nx, k, K) what surfaces reflect of a sun of irradiance 1 from each of the K
    directions, and ``seen`` (nz, ny, nx, K) how much of such a sun the probe sees; ``lights`` (3, nz, ny, nx, k, G) the light of
    each of the bake's own lights; ``local`` (3, nz, ny, nx, k, J) what surfaces reflect of a lamp of 1 W at each of the J sites.
    """

    grid: ProbeGrid
    sky: np.ndarray
    bounce: np.ndarray
    suns: np.ndarray
    seen: np.ndarray
    lights: np.ndarray
    local: np.ndarray

    @property
    def shape(self) -> tuple[int, int, int]:
        """(nz, ny, nx)."""
        return self.seen.shape[:3]

    @property
    def coefficients(self) -> int:
        """k."""
        return self.lights.shape[4]


@dataclass(frozen=True, eq=False)
class Transfer:
    """The ``grids`` of a bake, and what their columns mean.

    ``order`` of the probes, ``sky_order`` of skies, ``sun_side`` and ``sun_below`` of the suns' directions (numerics/dome.py);
    ``lights`` are (name, kind) of each column of the bake's own lights; ``sites`` (J, 3) in the world. ``world`` is the world that
    was baked, coarsely; ``surfaces`` are hashes by the names of what transfer depends on, ``sources`` what shone (follow.py);
    ``half`` whether it is to be stored in 16 bits, and ``sun_vectors`` by how many vectors suns are (0: direction by direction).
    """

    grids: tuple[TransferGrid, ...]
    order: int
    sky_order: int
    sun_side: int
    sun_below: bool
    lights: tuple[tuple[str, str], ...]
    sites: np.ndarray
    world: World
    surfaces: dict[str, str] = field(default_factory=dict)
    sources: dict[str, dict] = field(default_factory=dict)
    half: bool = True
    sun_vectors: int = 0

    @property
    def sun_directions(self) -> np.ndarray:
        """Directions (K, 3) towards the suns."""
        return dome.directions(self.sun_side, self.sun_below)

    @property
    def bytes_per_probe(self) -> int:
        """What the transfer of one probe takes as it is stored, before compression."""
        return stored_bytes(self.order, self.sky_order, len(self.sun_directions), len(self.sites), len(self.lights), self.half,
                            self.sun_vectors)


def stored_bytes(order: int, sky_order: int, suns: int, sites: int, lights: int, half: bool, vectors: int = 0) -> int:
    """What the transfer of one probe of an ``order`` takes as it is stored, before compression and without what all share."""
    k, sky = (order + 1) ** 2, (sky_order + 1) ** 2
    numbers = 4 * k * sky + 3 * k * (vectors if 0 < vectors < suns else suns) + suns + 3 * k * sites
    return numbers * (2 if half else 4) + 4 * 3 * k * lights
