"""A field of probes of which only those exist that certain points read: any lattice, however fine, for the price of these."""

import numpy as np

from ...numerics import grid as lattice
from ...numerics import octahedral
from ...scene import ProbeVolume
from ...techniques.lattice.field import ProbeField
from ...techniques.lattice.lookup import GridLookup, LookupSettings, neighbours, normal_bias


class SparseLookup(GridLookup):
    """A GridLookup whose arrays hold only the probes ``rows`` (m,) of the lattice, sorted flat indices: for points whose neighbours
    are all among them it says what the whole lattice would, except where none of the eight is live: there it says 0.

    ``positions`` (m, 3) float32 are the probes' in the world, ``live`` (m,) bool, ``visibility`` (m, T², 2) mean and mean squared
    distances; ``sh`` (m, k, 3) coefficients, which are taken as they are: deringing is up to whoever passes them.
    """

    def __init__(self, volume: ProbeVolume, rows: np.ndarray, positions: np.ndarray, live: np.ndarray, visibility: np.ndarray,
                 sh: np.ndarray, settings: LookupSettings | None = None):
        self.settings = settings or LookupSettings()
        self.volume, self.rows = volume, rows
        self.cell_volume = lattice.cell_volume(volume.world_from_local, volume.resolution)
        self.bias = normal_bias(volume, self.settings)
        self.centre = np.asarray(volume.world_from_local, np.float64)[:3, 3]
        self.positions = (positions - self.centre).astype(np.float32)
        self.live = live
        self.tile = round(np.sqrt(visibility.shape[1]))
        self.moments = octahedral.add_border(visibility.reshape(-1, self.tile, self.tile, 2).astype(np.float32)).reshape(-1, 2)
        self.coefficients = sh

    def neighbours(self, points: np.ndarray, surface_normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See GridLookup. A neighbour that is not there has no weight, for the points that the probes were made for."""
        index, trilinear = super().neighbours(points, surface_normals)
        return np.minimum(np.searchsorted(self.rows, index), len(self.rows) - 1), trilinear


def probes_read(volume: ProbeVolume, points: np.ndarray, surface_normals: np.ndarray) -> np.ndarray:
    """Sorted flat indices (m,) of the probes of ``volume`` that are read at ``points`` with ``surface_normals`` (n, 3)."""
    index, weight = neighbours(volume, points, surface_normals, normal_bias(volume, LookupSettings()))
    return np.unique(index[weight > 0])


def answered(volumes: tuple[ProbeVolume, ...], points: np.ndarray) -> list[np.ndarray]:
    """For each of ``volumes`` the rows of ``points`` (n, 3) that it has a share in, where all of them are one field."""
    nothing = np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0, bool), np.zeros((0, 1, 2)), np.zeros((0, 1, 3), np.float32)
    field = SparseField([SparseLookup(volume, *nothing) for volume in volumes])
    rows = {id(lookup.volume): np.flatnonzero(share) for lookup, share in zip(field.lookups, field.shares(points).T, strict=True)}
    return [rows[id(volume)] for volume in volumes]


def positions_of(volume: ProbeVolume, rows: np.ndarray) -> np.ndarray:
    """World positions (m, 3) float64 of the lattice points ``rows`` (m,)."""
    nx, ny, _ = volume.resolution
    points = np.stack([rows % nx, rows // nx % ny, rows // (nx * ny)], axis=-1)
    return lattice.transform_points(volume.world_from_local, lattice.local_from_lattice(points, volume.resolution))


class SparseField(ProbeField):
    """A field of SparseLookups, blended as ProbeField blends volumes. It can only be read."""

    def __init__(self, lookups: list[SparseLookup]):
        self.lookups = tuple(sorted(lookups, key=lambda lookup: lookup.cell_volume))
