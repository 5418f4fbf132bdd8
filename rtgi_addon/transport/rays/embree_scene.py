"""Embree's own C functions, by address from the library inside the embreex wheel, for the compiled kernels.

embreex copies every vertex through Python objects and traces one array a call; here triangles are shared with Embree where they
lie, and kernels call it from their inner loops. Numbers are those of Embree 4's headers (rtcore_scene.h, rtcore_geometry.h).
"""

import ctypes
import importlib.util
from functools import cache
from pathlib import Path

import numpy as np

from ... import kernels
from ..surfaces.geometry import Geometry
from .embree import EmbreeTracer, is_available, require_memory
from .tracer import Hits

_ROBUST, _TRIANGLES, _INDEX, _VERTEX, _UINT3, _FLOAT3 = 1 << 2, 0, 0, 1, 0x5003, 0x9003
_OUT_OF_MEMORY = 4
# Embree reads sixteen bytes from the last vertex on.
_PADDING = 4
_FUNCTIONS = {
    "rtcNewDevice": "ps", "rtcReleaseDevice": "vp", "rtcGetDeviceError": "ip", "rtcNewScene": "pp", "rtcReleaseScene": "vp",
    "rtcSetSceneFlags": "vpi", "rtcCommitScene": "vp", "rtcNewGeometry": "ppi", "rtcCommitGeometry": "vp",
    "rtcAttachGeometry": "upp", "rtcReleaseGeometry": "vp", "rtcSetSharedGeometryBuffer": "vpiuipzzz",
}
_TYPES = {"p": ctypes.c_void_p, "s": ctypes.c_char_p, "i": ctypes.c_int, "u": ctypes.c_uint, "z": ctypes.c_size_t, "v": None}
# What is used by address alone: traced through in src/tracer.h.
_BY_ADDRESS = ("rtcIntersect1", "rtcOccluded1", "rtcIntersect8", "rtcOccluded8")

class _Tracer(ctypes.Structure):
    """``Tracer`` of src/tracer.h."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("scene", "intersect1", "occluded1", "intersect8", "occluded8")]

class _Scene:
    """Triangles (t, 3, 3) in a scene of Embree's, with its BVH built; ``address`` is that of its ``Tracer``."""

    def __init__(self, triangles: np.ndarray):
        """Raises MemoryError."""
        embree, count = _library(), len(triangles)
        self._device = self._scene = None
        self._vertices = np.zeros(9 * count + _PADDING, np.float32)
        self._vertices[:9 * count] = triangles.reshape(-1)
        self._indices = np.arange(3 * count, dtype=np.uint32)
        self._device = embree.rtcNewDevice(None)
        if not self._device:
            raise MemoryError("Embree cannot start")
        self._scene = embree.rtcNewScene(self._device)
        embree.rtcSetSceneFlags(self._scene, _ROBUST)
        mesh = embree.rtcNewGeometry(self._device, _TRIANGLES)
        for kind, form, array, items in ((_VERTEX, _FLOAT3, self._vertices, 3 * count), (_INDEX, _UINT3, self._indices, count)):
            embree.rtcSetSharedGeometryBuffer(mesh, kind, 0, form, array.ctypes.data, 0, 12, items)
        embree.rtcCommitGeometry(mesh)
        embree.rtcAttachGeometry(self._scene, mesh)
        embree.rtcReleaseGeometry(mesh)
        embree.rtcCommitScene(self._scene)
        error = embree.rtcGetDeviceError(self._device)
        if error:
            raise MemoryError("Embree has not the memory for the scene" if error == _OUT_OF_MEMORY else f"Embree's error {error}")
        functions = (ctypes.cast(getattr(embree, name), ctypes.c_void_p).value for name in _BY_ADDRESS)
        self._tracer = _Tracer(self._scene, *functions)
        self.address = ctypes.addressof(self._tracer)

    def __del__(self):
        if self._scene:
            _library().rtcReleaseScene(self._scene)
        if self._device:
            _library().rtcReleaseDevice(self._device)

class KernelTracer(EmbreeTracer):
    """As EmbreeTracer, whose rays and hits it shares to the bit, through the kernels; they trace through ``kernel`` themselves."""

    def __init__(self, geometry: Geometry, threads: int | None = None):
        """Raises MemoryError if there is too little for the triangles."""
        require_memory(geometry.count)
        self._own, self._threads = _Scene(geometry.triangles_world), threads
        self.kernel = self._own.address

    def _intersect_chunk(self, origins, directions, limits) -> Hits:
        origins, directions, limits = _dense(origins, directions, limits)
        n = len(origins)
        primitive, (u, v, t) = np.empty(n, np.int32), np.empty((3, n), np.float32)
        kernels.call("intersect", self.kernel, n, origins, directions, limits, primitive, u, v, t)
        return Hits(primitive, u, v, t)

    def _occluded_chunk(self, origins, directions, limits) -> np.ndarray:
        origins, directions, limits = _dense(origins, directions, limits)
        hidden = np.empty(len(origins), bool)
        kernels.call("occluded", self.kernel, len(origins), origins, directions, limits, hidden)
        return hidden

def missing() -> str | None:
    """Why rays do not go through the kernels, as the end of a sentence; None where they do."""
    return kernels.missing() or (_trial() if is_available() else None)

def _dense(origins, directions, limits):
    origins, directions = np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32)
    if origins.shape != directions.shape or origins.shape[1:] != (3,):
        raise ValueError(f"rays from {origins.shape} along {directions.shape}")
    return origins, directions, None if limits is None else np.ascontiguousarray(limits, np.float32)

@cache
def _library() -> ctypes.CDLL:
    """The library inside the embreex wheel, its functions declared. Raises OSError or AttributeError."""
    package = Path(importlib.util.find_spec("embreex").origin).parent
    # Where the tools that repair wheels put it on Linux, macOS and Windows.
    found = [path for folder in (package.parent / "embreex.libs", package / ".dylibs", package)
             for path in sorted(folder.glob("*embree4*")) if path.suffix != ".pxd"]
    if not found:
        raise OSError("the embreex package has no library of Embree")
    library = ctypes.CDLL(str(found[0]))
    for name, letters in _FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = _TYPES[letters[0]], [_TYPES[letter] for letter in letters[1:]]
    for name in _BY_ADDRESS:
        getattr(library, name)
    return library

@cache
def _trial() -> str | None:
    """Hold a ray whose answer is known to each function: why they cannot be used, or None."""
    try:
        scene = _Scene(np.float32([[[0, 0, 2], [4, 0, 2], [0, 4, 2]]]))
    except (OSError, AttributeError, MemoryError) as error:
        return f"Embree's functions cannot be called ({error})"
    found = np.zeros(12, np.float32)
    kernels.call("try_tracer", scene.address, np.float32([1, 2, 0]), np.float32([0, 0, 1]), found)
    expected = np.float32([2, 0.25, 0.5, 2, 0.25, 0.5, -1, 0, 0, 1, 1, 0])
    same = np.allclose(found, expected, atol=1e-5)
    return None if same else "Embree's structures are not those that the kernels know"
