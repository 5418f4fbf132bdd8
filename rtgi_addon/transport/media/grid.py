"""Media whose density differs from place to place: look-up, and the optical depth along rays, cell by cell.

Between the planes through neighbouring samples a trilinear density is a cubic along a ray, which two points of Gauss-Legendre
integrate exactly; times a colour that is trilinear as well it takes four. Nothing is stepped over, nothing depends on a step size.

Source of the traversal: J. Amanatides and A. Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987.
"""

from typing import NamedTuple

import numpy as np

from ...numerics.grid import local_from_world, trilinear
from ...scene import Medium
from .inside import Convex


class Coefficients(NamedTuple):
    """What a medium does at points: ``scattering`` and ``absorption`` (n, 3) [1/m], ``emission`` (n, 3) [W·sr⁻¹·m⁻³], float64."""

    scattering: np.ndarray
    absorption: np.ndarray
    emission: np.ndarray

    @property
    def extinction(self) -> np.ndarray:
        """σ_t (n, 3) [1/m]."""
        return self.scattering + self.absorption


class GridTable:
    """A medium's grid made ready for look-ups; points outside its box are taken to lie on its faces, whoever asks knows better."""

    def __init__(self, medium: Medium):
        self._medium, grid = medium, medium.grid
        self._world_from_local, self._resolution = np.asarray(grid.world_from_local, np.float64), np.array(grid.resolution)
        self._arrays = {name: None if values is None else np.asarray(values, np.float32).reshape(grid.density.size, -1)
                        for name in ("density", "scattering", "absorption", "emission")
                        for values in (getattr(grid, name),)}
        coloured = grid.scattering is not None or grid.absorption is not None
        self._nodes, self._weights = np.polynomial.legendre.leggauss(4 if coloured else 2)
        self.box = Convex.box(grid.world_from_local)
        # The distance between neighbouring samples, the shortest of the three axes [m].
        self.cell = float((2.0 * np.linalg.norm(self._world_from_local[:3, :3], axis=0) / self._resolution).min())

    def coefficients(self, points: np.ndarray) -> Coefficients:
        """What the medium does at ``points`` (n, 3) in the world."""
        return self._at(self._lattice(points))

    @property
    def majorant(self) -> np.ndarray:
        """What extinction (3,) [1/m] exceeds nowhere."""
        scattering, absorption = (np.asarray(part, np.float64) * (1.0 if grid is None else grid.max(axis=0))
                                  for part, grid in ((self._medium.scattering, self._arrays["scattering"]),
                                                     (self._medium.absorption, self._arrays["absorption"])))
        return (scattering + absorption) * float(self._arrays["density"].max())

    def optical_depth(self, origins: np.ndarray, directions: np.ndarray, enter: np.ndarray, leave: np.ndarray) -> np.ndarray:
        """∫σ_t (n, 3) along rays (n, 3) float64 from ``enter`` to ``leave`` (n,), within the box; directions are unit."""
        start = self._lattice(origins)
        along = self._lattice(origins + directions) - start
        depth = np.zeros((len(origins), 3))
        rows = np.flatnonzero(leave > enter)
        start, along, here, leave = start[rows], along[rows], enter[rows], leave[rows]
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.abs(1.0 / along)
            first = start + along * here[:, None]
            plane = np.where(along > 0, np.floor(first) + 1.0, np.ceil(first) - 1.0)
            following = np.where(along == 0, np.inf, (plane - start) / along)
        while rows.size:
            axis = np.argmin(following, axis=1)
            n = np.arange(len(rows))
            end = np.clip(following[n, axis], here, leave)
            half = 0.5 * (end - here)
            for node, weight in zip(self._nodes, self._weights, strict=True):
                at = here + half * (1.0 + node)
                extinction = self._at(start + along * at[:, None], emission=False).extinction
                depth[rows] += extinction * (weight * half)[:, None]
            following[n, axis] += step[n, axis]
            kept = end < leave
            rows, start, along, here, leave, following, step = (
                part[kept] for part in (rows, start, along, end, leave, following, step))
        return depth

    def _lattice(self, points) -> np.ndarray:
        return (local_from_world(self._world_from_local, points) + 1.0) * (0.5 * self._resolution) - 0.5

    def _at(self, lattice: np.ndarray, emission: bool = True) -> Coefficients:
        index, weight = trilinear(lattice, self._resolution)

        def of(name):
            values = self._arrays[name]
            return 1.0 if values is None else np.einsum("nkc,nk->nc", values[index], weight, dtype=np.float64)

        density, medium = of("density"), self._medium
        return Coefficients(medium.scattering * density * of("scattering"), medium.absorption * density * of("absorption"),
                            np.broadcast_to(medium.emission * of("emission"), (len(lattice), 3)) if emission else None)
