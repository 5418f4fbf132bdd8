"""What the kernels read of textures and attributes: the tables of ``materials`` as C has them."""

import ctypes

import numpy as np

from ... import kernels
from ...scene import Channel
from .geometry import dense

_TYPES = {np.dtype(np.uint8): 0, np.dtype(np.float16): 1, np.dtype(np.float32): 2}
_EXTENSIONS = {"REPEAT": 0, "MIRROR": 1, "CLIP": 2}
_EXTEND = 3


class _LookUp(ctypes.Structure):
    """``LookUp`` of kernels/src/surfaces.c."""

    _fields_ = [("texels", ctypes.c_void_p), ("width", ctypes.c_int64), ("height", ctypes.c_int64),
                *((name, ctypes.c_int32) for name in ("type", "extension", "closest", "srgb", "component", "transformed")),
                ("transform", ctypes.c_float * 6), ("uv", ctypes.c_void_p), ("attribute", ctypes.c_void_p)]


class LookUps:
    """The ``channels`` that the materials of ``surfaces`` (Surfaces) share, ``group`` (faces,) of each face (-1: none), with its
    ``factors`` and ``offsets`` (faces, 3)."""

    def __init__(self, surfaces, channels: list[Channel], group: np.ndarray, factors: np.ndarray, offsets: np.ndarray):
        # C holds addresses: what they point into lives as long as this.
        self._kept: list[np.ndarray] = []
        self._geometry, self._group = surfaces.geometry, group.astype(np.int32)
        self._factors, self._offsets = np.ascontiguousarray(factors), np.ascontiguousarray(offsets)
        self._looks = (_LookUp * len(channels))(*(self._look_up(surfaces, channel) for channel in channels))
        self._mesh_triangles = int(self._geometry.mesh_offsets[-1])

    def _look_up(self, surfaces, channel: Channel) -> _LookUp:
        look = _LookUp(component=-1)
        if channel.texture is not None:
            sampler = surfaces.sampler(channel.texture)
            texels = sampler.texels
            look.texels, look.type = self._address(texels), _TYPES[texels.dtype]
            look.width, look.height = sampler.width, sampler.height
            look.extension = _EXTENSIONS.get(channel.texture.extension, _EXTEND)
            look.closest, look.srgb = channel.texture.interpolation == "Closest", bool(channel.texture.srgb)
            if channel.texture_channel != "rgb":
                look.component = "rgba".index(channel.texture_channel)
            look.uv = self._address(np.ascontiguousarray(surfaces.corner_uv(channel.uv_layer), np.float32))
            if channel.uv_transform is not None:
                look.transformed = 1
                look.transform[:] = np.asarray(channel.uv_transform, np.float32).reshape(-1).tolist()
        if channel.attribute is not None:
            look.attribute = self._address(np.ascontiguousarray(surfaces.corner_attribute(channel.attribute), np.float32))
        return look

    def _address(self, array: np.ndarray) -> int:
        self._kept.append(array)
        return array.ctypes.data

    def evaluate(self, constants: np.ndarray, low: float, high: float, face: np.ndarray, primitive: np.ndarray, u: np.ndarray,
                 v: np.ndarray) -> np.ndarray:
        """Values (n, 3) between ``low`` and ``high`` on sides ``face`` (n,) of triangles ``primitive`` (n,) at ``u`` and ``v``
        (n,), those of ``constants`` (faces, 3) where nothing is looked up."""
        n, geometry, values = len(primitive), self._geometry, np.empty((len(primitive), 3), np.float32)
        faces = np.ascontiguousarray(np.broadcast_to(face, (n,)), np.int32)
        kernels.call("surface_values", len(constants), np.ascontiguousarray(constants, np.float32), self._factors, self._offsets,
                     self._group, len(self._looks), ctypes.addressof(self._looks), low, high, geometry.count,
                     geometry.mesh_triangle, self._mesh_triangles, geometry.material, n, faces, *dense(n, primitive, u, v), values)
        return values
