"""What the probes of one volume say about a point on a surface: its neighbours, weighted by what they can know of it.

The weight of a neighbour (`weights.py`) is trilinear × ((n·d + 1)/2)² + 0.2 (d towards the probe: probes behind the surface count
little) × (½(1 − x/√(1 + x²)))², x = (r − μ)/σ, for how surely the probe sees the point at distance r, from the mean μ and variance
σ² of the distances it stored in that direction; weights below 0.2 are crushed to w³/0.2². Probes inside geometry weigh nothing.
The eight are those about a point a little off the surface, so that one which lies on a plane of probes reads those in front of it.

Where DDGI keeps a visibility of at least 0.05, which leaves 0.3 % of a lit room in the black one behind a thin wall, all
weights here share a floor of 1e-6 of the plain trilinear weight: it decides only where no neighbour sees the point, and makes
the answer there the trilinear one over the live probes. Where none of the eight is live, dilated coefficients take over.

Scattered probes stand on no lattice. There each node of a lattice over the volume names some probes that see it, with shares
(scene/scattered.py), and a probe's weight is its interpolated share in the place of the trilinear one: continuous everywhere, since
shares are fixed at nodes and trilinear between them. All else is the same.

Source: Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019, and NVIDIA's
RTXGI-DDGI SDK, Irradiance.hlsl (DDGIGetVolumeIrradiance).
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import grid as lattice
from ...numerics import octahedral
from ...scene import ProbeVolume
from ...scene.scattered import SLOTS, named
from ..base import ProbeGrid
from .dilation import dilate, live_probes
from .reconstruction import RECONSTRUCTIONS, dering, reconstruct
from .weights import AT_PROBE, LIFT, coverage, probe_weight, seen_share, side_weight

# Points that are read at once: their eight probes' coefficients stay small.
_CHUNK = 1 << 14


@dataclass(frozen=True)
class LookupSettings:
    """How a field of probes is read.

    ``reconstruction`` is one of RECONSTRUCTIONS; ``visibility`` turns the weight by what probes see on, ``normal_weight`` that by
    the side of the surface (both off: plain trilinear, as most engines do). ``normal_bias`` moves the point that must be seen along
    its normal, in shares of the smallest cell side: large enough that a surface does not hide itself, small against a room and the
    walls around it. Without visibility there is none.
    """

    reconstruction: str = "deringed"
    visibility: bool = True
    normal_weight: bool = True
    normal_bias: float = 0.2

    def __post_init__(self):
        if self.reconstruction not in RECONSTRUCTIONS:
            raise ValueError(f"reconstruction {self.reconstruction!r} is none of {', '.join(RECONSTRUCTIONS)}")


class GridLookup:
    """One ``ProbeGrid`` made ready for reading: dilated, deringed if asked for, positions and distances laid out flat.

    ``centre`` (3,) float64 is the volume's [m], and ``positions`` (p, 3) float32 the probes' from there, moved as ``offset_world``
    (nz, ny, nx, 3) says; ``live`` (p,) bool tells which hold light; ``coefficients`` (p, k, 3) float32 are SH of radiance;
    ``moments`` (p·(T + 2)², 2) float32 mean and mean squared distance [m] in bordered octahedral tiles of ``tile`` T; ``bias`` [m]
    is the one along normals.
    """

    def __init__(self, grid: ProbeGrid, settings: LookupSettings):
        self.settings = settings
        self.volume = grid.volume
        self.cell_volume = lattice.cell_volume(grid.volume.world_from_local, grid.volume.nodes)
        self.bias = normal_bias(grid.volume, settings)
        # Positions count from the volume's centre, so that float32 keeps its digits far from the world's origin.
        self.centre = np.asarray(grid.volume.world_from_local, np.float64)[:3, 3]
        points = lattice.lattice_points(grid.volume.world_from_local, grid.volume.resolution) - self.centre
        self.positions = (points + grid.offset_world).reshape(-1, 3).astype(np.float32)
        self.offset_world = grid.offset_world
        self.live = live_probes(grid).ravel()
        sh = dilate(grid).sh
        self.coefficients = (dering(sh) if settings.reconstruction == "deringed" else sh).reshape(-1, *sh.shape[3:])
        self.tile = grid.visibility.shape[3]
        self.moments = octahedral.add_border(np.asarray(grid.visibility, np.float32)).reshape(-1, 2)

    def coverage(self, points: np.ndarray) -> np.ndarray:
        """(n,) float32: 1 inside the volume, falling to 0 over its outermost cell, 0 outside."""
        volume = self.volume
        return coverage(lattice.lattice_from_world(volume.world_from_local, volume.nodes, points), volume.nodes)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n,) float64: from ``points`` to the point of the box with the nearest local coordinates [m]; 0 inside."""
        return lattice.box_distance(self.volume.world_from_local, points)

    def irradiance(self, points: np.ndarray, normals: np.ndarray, surface_normals: np.ndarray | None = None) -> np.ndarray:
        """Irradiance (n, 3) float32, never negative, at ``points`` with unit ``normals`` (n, 3), world space.

        ``surface_normals`` (n, 3) are those before bumps (`weights.py`), the same if None. Points outside take the outermost
        probes.
        """
        result = np.empty((len(points), self.coefficients.shape[-1]), np.float32)
        surface_normals = normals if surface_normals is None else surface_normals
        for start in range(0, len(points), _CHUNK):
            rows = slice(start, start + _CHUNK)
            result[rows] = self.read(self.coefficients, *self.weights(points[rows], surface_normals[rows]), normals[rows])
        return result

    def read(self, coefficients: np.ndarray, index: np.ndarray, weight: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) float32 for unit ``normals`` (n, 3) from what probes ``index`` (n, m) have of ``coefficients``
        (p, k, 3), by ``weight`` (n, m)."""
        blended = np.zeros((len(index), *coefficients.shape[1:]), np.float32)
        for corner in range(index.shape[1]):
            blended += weight[:, corner, None, None] * coefficients[index[:, corner]]
        return reconstruct(self.settings.reconstruction, blended, np.asarray(normals, np.float32))

    def weights(self, points: np.ndarray, surface_normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Flat probe indices (n, m) and their weights (n, m) float32, which sum to 1: of eight probes, or of those that eight nodes
        name."""
        surface_normals = np.asarray(surface_normals, np.float32)
        index, trilinear, live = self._neighbours(points, surface_normals)
        relative = (np.asarray(points, np.float64) - self.centre).astype(np.float32)
        seen = np.ones_like(trilinear)
        if self.settings.normal_weight:
            seen *= side_weight(self.positions[index] - relative[:, None], surface_normals[:, None])
        if self.settings.visibility:
            biased = relative + np.float32(self.bias) * surface_normals
            seen *= self._visibility(index, biased[:, None] - self.positions[index])
        weight = probe_weight(trilinear, seen, live)
        return index, weight / weight.sum(axis=1, keepdims=True)

    def neighbours(self, points: np.ndarray, surface_normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows (n, m) in this lookup's arrays of the probes that are read at ``points`` (n, 3), and their interpolated shares."""
        return neighbours(self.volume, points, surface_normals, self.bias)

    def _neighbours(self, points: np.ndarray, surface_normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As ``neighbours``, and which (n, m) of them hold light that is meant for there."""
        index, share = self.neighbours(points, surface_normals)
        return index, np.abs(share), self.live[index] & (share >= 0)

    def _visibility(self, index: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """(n, m): how surely probe ``index`` sees the point at ``offset`` (n, m, 3) from it."""
        distance = np.linalg.norm(offset, axis=-1)
        at_probe = (distance <= AT_PROBE * self.bias)[..., None]
        texel, fraction = octahedral.bilinear(np.where(at_probe, np.float32([0, 0, 1]), offset), self.tile)
        width = self.tile + 2
        texel = texel + index * (width * width)
        x, y = fraction[..., :1], fraction[..., 1:]
        lower = (1.0 - x) * self.moments[texel] + x * self.moments[texel + 1]
        upper = (1.0 - x) * self.moments[texel + width] + x * self.moments[texel + width + 1]
        moments = lower + y * (upper - lower)
        return seen_share(distance, moments[..., 0], moments[..., 1])


def normal_bias(volume: ProbeVolume, settings: LookupSettings) -> float:
    """How far the point that must be seen is moved along its normal [m]."""
    return settings.visibility * settings.normal_bias * lattice.cell_size(volume.world_from_local, volume.nodes).min()


def neighbours(volume: ProbeVolume, points: np.ndarray, surface_normals: np.ndarray, bias: float) -> tuple[np.ndarray, np.ndarray]:
    """Flat indices (n, m) of the probes of ``volume`` that are read at ``points`` with ``surface_normals`` (n, 3), and their
    trilinear weights (n, m), for m = 8; or of the probes that the eight nodes of a scattered volume name, and their shares times
    those weights, negative where they stand in for ones that would see them. ``bias`` is ``normal_bias``."""
    lifted = points + LIFT * bias * np.asarray(surface_normals, np.float64)
    index, trilinear = lattice.trilinear(lattice.lattice_from_world(volume.world_from_local, volume.nodes, lifted), volume.nodes)
    if volume.scattered is None:
        return index, trilinear
    named_there = volume.scattered.index.reshape(-1, SLOTS)[index]
    probes, shares = named(named_there)
    shares = trilinear[..., None] * np.where(named_there < 0, -shares, shares)
    return probes.reshape(len(index), -1), shares.reshape(len(index), -1)
