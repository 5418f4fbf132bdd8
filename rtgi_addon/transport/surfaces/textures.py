"""Image textures at arrays of UVs, filtered as Cycles filters them."""

import numpy as np

from ...scene import Texture

_UNIT_FROM_BYTE = np.float32(1.0 / 255.0)
# Integers that hold a whole texel of four.
_PACKED = {np.dtype(np.uint8): np.uint32, np.dtype(np.float16): np.uint64}


class TextureSampler:
    """One image, laid out so that a texel is fetched with a single load: four bytes, half floats or floats a texel."""

    def __init__(self, texture: Texture):
        self._texture = texture
        self.height, self.width, channels = texture.pixels.shape
        kept = texture.pixels.dtype in _PACKED
        self._dtype = texture.pixels.dtype if kept else np.dtype(np.float32)
        rgba = np.ascontiguousarray(texture.pixels, self._dtype).reshape(-1, channels)
        if channels != 4:
            opaque = np.full((len(rgba), 4), 255 if self._dtype == np.uint8 else 1, rgba.dtype)
            opaque[:, :3] = rgba
            rgba = opaque
        self._texels = rgba.view(_PACKED[self._dtype]).reshape(-1) if kept else rgba

    @property
    def texels(self) -> np.ndarray:
        """Four components a texel, row by row, as the kernels read them: bytes, half floats or floats."""
        return self._texels.view(self._dtype)

    def sample(self, uv: np.ndarray, component: str = "rgb") -> np.ndarray:
        """Texture value (n, 3), scene-linear, at ``uv`` (n, 2): bilinear between texel centres (or the nearest texel for
        'Closest'), v = 0 at row 0, outside handled by the texture's extension as Cycles does (CLIP is black and transparent).
        ``component`` 'r', 'g', 'b' or 'a' reads one channel into all three (alpha is 1 where the image has none).

        sRGB is decoded after filtering, as in Cycles (`svm_image_texture`), which also costs one decoding instead of four."""
        value = self._filtered(uv)
        if component == "rgb":
            value = value[:, :3]
        else:
            value = np.repeat(value[:, ["rgba".index(component)]], 3, axis=1)
        return linear_from_srgb(value) if self._texture.srgb and component != "a" else np.ascontiguousarray(value)

    def _filtered(self, uv: np.ndarray) -> np.ndarray:
        x, y = uv[:, 0] * np.float32(self.width), uv[:, 1] * np.float32(self.height)
        if self._texture.interpolation == "Closest":
            return self._weighted(np.floor(x), np.floor(y), None)
        x, y = x - np.float32(0.5), y - np.float32(0.5)
        column, row = np.floor(x), np.floor(y)
        fx, fy = x - column, y - row
        gx, gy = 1 - fx, 1 - fy
        value = self._weighted(column, row, gx * gy)
        value += self._weighted(column + 1, row, fx * gy)
        value += self._weighted(column, row + 1, gx * fy)
        value += self._weighted(column + 1, row + 1, fx * fy)
        return value

    def _weighted(self, column: np.ndarray, row: np.ndarray, weight: np.ndarray | None) -> np.ndarray:
        """RGBA (n, 4) of texels at whole ``column`` and ``row`` (n,), times ``weight`` (n,)."""
        column, inside_x = self._index(column, self.width)
        row, inside_y = self._index(row, self.height)
        texels = np.take(self._texels, row * self.width + column, axis=0)
        scale = np.float32(1.0) if weight is None else weight
        if texels.ndim == 1:
            texels = texels.view(self._dtype).reshape(-1, 4)
            scale = scale * _UNIT_FROM_BYTE if self._dtype == np.uint8 else scale
        if inside_x is not None:
            scale = scale * (inside_x & inside_y)
        return np.multiply(texels, np.broadcast_to(scale, len(texels))[:, None], dtype=np.float32)

    def _index(self, position: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray | None]:
        """Index (n,) of whole texel positions (n,) brought inside by the extension, and for CLIP which were inside before."""
        extension, inside = self._texture.extension, None
        index = position.astype(np.int64)
        if extension == "REPEAT":
            # A power of two wraps with a mask, tens of times as fast as the division.
            return index & (size - 1) if size & (size - 1) == 0 else index % size, None
        if extension == "MIRROR":
            period = index % (2 * size)
            return np.where(period < size, period, 2 * size - 1 - period), None
        if extension == "CLIP":
            inside = (index >= 0) & (index < size)
        return np.clip(index, 0, size - 1), inside


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """As numerics.colour has it, with products for quotients: every hit on a texture is decoded."""
    curve = ((np.maximum(encoded, np.float32(0)) + np.float32(0.055)) * np.float32(1 / 1.055)) ** np.float32(2.4)
    return np.where(encoded <= np.float32(0.04045), encoded * np.float32(1 / 12.92), curve)
