"""Inner loops of VPLs, RSMs, LPVs and voxels as functions from arrays to arrays: numpy and the GPU can take each other's place.

``Technique.bake(..., kernels=...)`` takes any object that keeps this protocol; ``NUMPY`` is the one for the CPU, and what a GPU's
must agree with. Signatures and conventions are those of the numpy functions that ``NumpyKernels`` names.
"""

from typing import Protocol

import numpy as np


class Kernels(Protocol):
    """What the techniques vpl, rsm and lpv, and those that go through voxels, ask of a device."""

    def capture(self, context, view):
        """``transport.views.reflective_shadow_map.capture``: what the lamp of a ShadowView sees, as a ReflectiveShadowMap."""

    def rsm_gather(self, maps, points: np.ndarray, normals: np.ndarray, pattern) -> np.ndarray:
        """``techniques.rsm.gather.gather``: the paper's unoccluded gather, irradiance (n, 3)."""

    def lpv_inject(self, grid, positions: np.ndarray, normals: np.ndarray, flux: np.ndarray, faces=None) -> np.ndarray:
        """``techniques.lpv.injection.inject``: virtual lights into an SH volume (4, 3, nz, ny, nx)."""

    def lpv_propagate(self, coefficients: np.ndarray, blocking, steps: int, *, threads: int | None = None,
                      progress=None) -> np.ndarray:
        """``techniques.lpv.propagation.propagate``: the accumulated volume after some steps."""

    def lpv_gather(self, grids, volumes, points: np.ndarray, normals: np.ndarray, dampening: bool = False,
                   faces=None) -> np.ndarray:
        """``techniques.lpv.gather.gather``: irradiance (n, 3) from accumulated volumes."""

    def vpl_gather(self, lights, points: np.ndarray, normals: np.ndarray, visibility: np.ndarray | None,
                   clamp: float | None) -> np.ndarray:
        """``techniques.vpl.gather.gather_visible``: irradiance (n, 3) from surface VPLs with known visibility (n, m)."""

    def voxel_crossings(self, grid, corners: np.ndarray, primitive: np.ndarray, axis: int, lines: int):
        """``transport.voxels.crossings.crossings``: where lines along an axis meet triangles, as Crossings."""


class NumpyKernels:
    """The kernels on the CPU. Each technique is imported when it is first asked for: techniques import this module."""

    def capture(self, context, view):
        """See Kernels."""
        from ..transport.views.reflective_shadow_map import capture
        return capture(context, view)

    def rsm_gather(self, maps, points: np.ndarray, normals: np.ndarray, pattern) -> np.ndarray:
        """See Kernels."""
        from .rsm.gather import gather
        return gather(maps, points, normals, pattern)

    def lpv_inject(self, grid, positions: np.ndarray, normals: np.ndarray, flux: np.ndarray, faces=None) -> np.ndarray:
        """See Kernels."""
        from .lpv.injection import inject
        return inject(grid, positions, normals, flux, faces)

    def lpv_propagate(self, coefficients: np.ndarray, blocking, steps: int, *, threads: int | None = None,
                      progress=None) -> np.ndarray:
        """See Kernels."""
        from .lpv.propagation import propagate
        return propagate(coefficients, blocking, steps, threads=threads, progress=progress)

    def lpv_gather(self, grids, volumes, points: np.ndarray, normals: np.ndarray, dampening: bool = False,
                   faces=None) -> np.ndarray:
        """See Kernels."""
        from .lpv.gather import gather
        return gather(grids, volumes, points, normals, dampening, faces)

    def vpl_gather(self, lights, points, normals, visibility, clamp) -> np.ndarray:
        """See Kernels."""
        from .vpl.gather import gather_visible
        return gather_visible(lights, points, normals, visibility, clamp)

    def voxel_crossings(self, grid, corners, primitive, axis: int, lines: int):
        """See Kernels."""
        from ..transport.voxels.crossings import crossings
        return crossings(grid, corners, primitive, axis, lines)


NUMPY = NumpyKernels()
