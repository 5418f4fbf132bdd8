"""The techniques' kernels on the GPU (techniques/kernels.py, ``Kernels``): arrays in, arrays out, on Blender's main thread."""

import numpy as np

from . import capture, context, gather, light_volume


class GpuKernels:
    """The kernels of ``--device gpu``. Raises BakeError where there is no GPU context; every call must come from that thread."""

    def __init__(self):
        context.require()

    def capture(self, context, view):
        """See Kernels."""
        return capture.capture(context, view)

    def rsm_gather(self, maps, points: np.ndarray, normals: np.ndarray, pattern) -> np.ndarray:
        """See Kernels."""
        return gather.rsm_gather(maps, points, normals, pattern)

    def lpv_inject(self, grid, positions: np.ndarray, normals: np.ndarray, flux: np.ndarray) -> np.ndarray:
        """See Kernels."""
        return light_volume.inject(grid, positions, normals, flux)

    def lpv_propagate(self, coefficients: np.ndarray, blocking, steps: int, *, threads=None, progress=None) -> np.ndarray:
        """See Kernels."""
        return light_volume.propagate(coefficients, blocking, steps, threads=threads, progress=progress)

    def lpv_gather(self, grids, volumes, points: np.ndarray, normals: np.ndarray, dampening: bool = True) -> np.ndarray:
        """See Kernels."""
        return gather.lpv_gather(grids, volumes, points, normals, dampening)

    def vpl_gather(self, lights, points: np.ndarray, normals: np.ndarray, visibility, clamp) -> np.ndarray:
        """See Kernels."""
        return gather.vpl_gather(lights, points, normals, visibility, clamp)
