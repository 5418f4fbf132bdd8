"""The techniques' kernels on the GPU (techniques/kernels.py, ``Kernels``): arrays in, arrays out.

Blender's GPU works on its main thread only. What asks from another, such as a picture drawn on every core, gets numpy's answer,
which is the same to float precision.
"""

import threading
from collections.abc import Callable

import numpy as np

from ..techniques.kernels import NUMPY
from . import capture, context, gather, light_volume, voxel_crossings


class GpuKernels:
    """The kernels of ``--device gpu``. Raises BakeError where there is no GPU context, or on another thread than the main one."""

    def __init__(self):
        context.require()

    def capture(self, context, view):
        """See Kernels."""
        return _here("capture", capture.capture)(context, view)

    def rsm_gather(self, maps, points: np.ndarray, normals: np.ndarray, pattern) -> np.ndarray:
        """See Kernels."""
        return _here("rsm_gather", gather.rsm_gather)(maps, points, normals, pattern)

    def lpv_inject(self, grid, positions: np.ndarray, normals: np.ndarray, flux: np.ndarray, faces=None) -> np.ndarray:
        """See Kernels."""
        return _here("lpv_inject", light_volume.inject)(grid, positions, normals, flux, faces)

    def lpv_propagate(self, coefficients: np.ndarray, blocking, steps: int, *, threads=None, progress=None) -> np.ndarray:
        """See Kernels."""
        return _here("lpv_propagate", light_volume.propagate)(coefficients, blocking, steps, threads=threads, progress=progress)

    def lpv_gather(self, grids, volumes, points: np.ndarray, normals: np.ndarray, dampening: bool = False,
                   faces=None) -> np.ndarray:
        """See Kernels."""
        return _here("lpv_gather", gather.lpv_gather)(grids, volumes, points, normals, dampening, faces)

    def vpl_gather(self, lights, points: np.ndarray, normals: np.ndarray, visibility, clamp) -> np.ndarray:
        """See Kernels."""
        return _here("vpl_gather", gather.vpl_gather)(lights, points, normals, visibility, clamp)

    def voxel_crossings(self, grid, corners: np.ndarray, primitive: np.ndarray, axis: int, lines: int):
        """See Kernels."""
        return _here("voxel_crossings", voxel_crossings.crossings)(grid, corners, primitive, axis, lines)


def _here(name: str, on_gpu: Callable) -> Callable:
    """``on_gpu`` on the main thread, numpy's kernel of that name elsewhere."""
    return on_gpu if threading.current_thread() is threading.main_thread() else getattr(NUMPY, name)
