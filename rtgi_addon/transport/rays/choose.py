"""The fastest tracer there is: Embree; without its wheel Blender's BVH; outside Blender the numpy twin."""

import platform
import sys

from ..surfaces.geometry import Geometry
from ..surfaces.materials import Surfaces
from . import embree, embree_scene
from .alpha import AlphaTracer
from .brute_force import BruteForceTracer
from .bvh_tree import SLOWER, BVHTreeTracer
from .tracer import Tracer

# How many times as long a bake takes whose work around the rays is numpy's (benchmarks/README.md).
SLOWER_IN_NUMPY = 1.7
_KERNELS_REMEDY = "install the extension's zip made for this system, or run `make setup`"


def make_tracer(geometry: Geometry, surfaces: Surfaces | None = None, threads: int | None = None) -> Tracer:
    """The fastest tracer there is for ``geometry``; with ``surfaces``, one that honours alpha."""
    tracer = make_opaque_tracer(geometry, threads)
    if surfaces is not None and surfaces.has_transparency:
        return AlphaTracer(tracer, geometry, surfaces)
    return tracer


def make_opaque_tracer(geometry: Geometry, threads: int | None = None) -> Tracer:
    """The fastest tracer there is, for ``geometry`` without its materials."""
    if not embree.is_available():
        return _without_embree(geometry)
    return (embree.EmbreeTracer if embree_scene.missing() else embree_scene.KernelTracer)(geometry, threads)


def _without_embree(geometry: Geometry) -> Tracer:
    try:
        return BVHTreeTracer(geometry)
    except ImportError:  # mathutils comes with Blender alone
        return BruteForceTracer(geometry)


def _slow_kernels_warning() -> str | None:
    """What to tell the user where rays go through Embree but the compiled kernels do not run, and what to do, or None."""
    reason = embree_scene.missing()
    if reason is None:
        return None
    return (f"there are no compiled kernels here ({reason}): numpy does their work, which makes bakes some {SLOWER_IN_NUMPY} times "
            f"slower; {_KERNELS_REMEDY}")


def slow_rays_warning() -> str | None:
    """What to tell the user where rays do not go through Embree, or not through the compiled kernels, and what to do; None where
    they do."""
    if embree.is_available():
        return _slow_kernels_warning()
    on_arm = platform.machine().lower() in ("arm64", "aarch64") and sys.platform != "darwin"
    remedy = ("the package does not exist for this system" if on_arm else
              "install the extension's zip made for this system, or that package, and restart Blender")
    return (f"there is no Embree here (the Python package embreex): rays go through Blender's BVH, which makes bakes some {SLOWER} "
            f"times slower, and more on many cores; {remedy}")
