"""A field of probes of which only those exist that certain points read: any lattice, however fine, for the price of these."""

import numpy as np

from ...numerics import grid as lattice
from ...numerics import octahedral
from ...scene import ProbeVolume
from ...techniques.probes.field import ProbeField
from ...techniques.probes.lookup import GridLookup, LookupSettings


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
        self.bias = self.settings.normal_bias * lattice.cell_size(volume.world_from_local, volume.resolution).min()
        self.centre = np.asarray(volume.world_from_local, np.float64)[:3, 3]
        self.positions = (positions - self.centre).astype(np.float32)
        self.live = live
        self.tile = round(np.sqrt(visibility.shape[1]))
        self.moments = octahedral.add_border(visibility.reshape(-1, self.tile, self.tile, 2).astype(np.float32)).reshape(-1, 2)
        self.coefficients = sh

    def holding(self, sh: np.ndarray) -> "SparseLookup":
        """The same probes with other coefficients ``sh`` (m, k, 3)."""
        other = object.__new__(SparseLookup)
        other.__dict__.update(self.__dict__)
        other.coefficients = sh
        return other

    def neighbours(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See GridLookup. A neighbour that is not there has no weight, for the points that the probes were made for."""
        index, trilinear = super().neighbours(points)
        return np.minimum(np.searchsorted(self.rows, index), len(self.rows) - 1), trilinear


def probes_read(volume: ProbeVolume, points: np.ndarray) -> np.ndarray:
    """Sorted flat indices (m,) of the probes of ``volume`` that interpolation at ``points`` (n, 3) reads."""
    position = lattice.lattice_from_world(volume.world_from_local, volume.resolution, points)
    index, weight = lattice.trilinear(position, volume.resolution)
    return np.unique(index[weight > 0])


def positions_of(volume: ProbeVolume, rows: np.ndarray) -> np.ndarray:
    """World positions (m, 3) float64 of the lattice points ``rows`` (m,)."""
    nx, ny, _ = volume.resolution
    points = np.stack([rows % nx, rows // nx % ny, rows // (nx * ny)], axis=-1)
    return lattice.transform_points(volume.world_from_local, lattice.local_from_lattice(points, volume.resolution))


class SparseField(ProbeField):
    """A field of SparseLookups, blended as ProbeField blends volumes. It can only be read."""

    def __init__(self, lookups: list[SparseLookup]):
        self.lookups = tuple(sorted(lookups, key=lambda lookup: lookup.cell_volume))

    def holding(self, change) -> "SparseField":
        """The same field with ``change(lookup)`` → coefficients (m, k, 3) in place of each lookup's own."""
        return SparseField([lookup.holding(change(lookup)) for lookup in self.lookups])
