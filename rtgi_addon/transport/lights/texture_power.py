"""How bright a texture is within any box of texels: nothing within it is missed, however small.

Source: F. Crow, "Summed-Area Tables for Texture Mapping", SIGGRAPH 1984, of the values and of their squares.
"""

import numpy as np

from ...scene import Texture
from ..surfaces.textures import linear_from_srgb
from ..vectors import LUMINANCE

# Tables have this side at most; a larger texture is averaged in blocks first, which loses no texel of its sums.
MAX_SIDE = 2048


class TexturePower:
    """Sums of the luminance of ``colour`` (3,) times the texels of ``texture``, of which ``component`` 'r', 'g', 'b' or 'a' reads
    one channel, and of its squares."""

    def __init__(self, texture: Texture, component: str, colour: np.ndarray):
        self._extension = texture.extension
        self._height, self._width = texture.pixels.shape[:2]
        block_y, block_x = -(-self._height // MAX_SIDE), -(-self._width // MAX_SIDE)
        weights = (LUMINANCE * np.maximum(colour, 0.0)).astype(np.float32)
        rows = max(1, (1 << 18) // (self._width * block_y)) * block_y
        parts = [_blocks(texture, component, weights, slice(start, start + rows), block_y, block_x)
                 for start in range(0, self._height, rows)]
        self._tables = [_summed(np.concatenate(columns), self._extension) for columns in zip(*parts, strict=True)]
        self._block = np.array([block_x, block_y])

    def moments(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and mean square (n,) float64 of what filtering can read between the corners ``low`` and ``high`` (n, 2) of boxes
        in UV: all texels that they touch and one more around them."""
        scale = np.array([self._width, self._height], np.float64)
        first, last = np.floor(low * scale - 1.0), np.ceil(high * scale + 1.0)
        first, last = np.floor(first / self._block), np.maximum(np.ceil(last / self._block), np.floor(first / self._block) + 1)
        area = np.prod(last - first, axis=1)
        if self._extension in ("EXTEND", "CLIP"):
            sides = np.array([self._tables[0].shape[1] - 1, self._tables[0].shape[0] - 1])
            if self._extension == "EXTEND":
                first = np.clip(first, 0, sides - 1)
                last = np.clip(last, first + 1, sides)
                area = np.prod(last - first, axis=1)
            else:
                first, last = np.clip(first, 0, sides), np.clip(last, 0, sides)
        first, last = first.astype(np.int64), last.astype(np.int64)
        sums = [_box(table, first, last) for table in self._tables]
        return tuple(np.maximum(part, 0.0) / area for part in sums)

    @property
    def texel(self) -> np.ndarray:
        """Size (2,) in UV of what the tables resolve."""
        return self._block / np.array([self._width, self._height], np.float64)


def _luminance(texture: Texture, component: str, weights: np.ndarray, rows: slice) -> np.ndarray:
    """Luminance (h, w) float32 of texels, ``weights`` (3,) for each channel."""
    pixels = texture.pixels[rows]
    channels = pixels.shape[2]
    if component == "a" and channels < 4:
        return np.full(pixels.shape[:2], weights.sum(), np.float32)
    if component != "rgb" or channels < 3:
        pixels, weights = pixels[..., [min(max("rgba".find(component), 0), channels - 1)]], weights.sum(keepdims=True)
    decoded = np.arange(256, dtype=np.float32) / np.float32(255.0) if pixels.dtype == np.uint8 else None
    srgb = texture.srgb and component != "a"
    total = np.zeros(pixels.shape[:2], np.float32)
    for channel, weight in enumerate(weights.tolist()):
        if decoded is not None:
            total += (np.float32(weight) * (linear_from_srgb(decoded) if srgb else decoded))[pixels[..., channel]]
        else:
            values = pixels[..., channel].astype(np.float32, copy=False)
            total += np.float32(weight) * (linear_from_srgb(values) if srgb else values)
    return np.maximum(total, 0.0)


def _blocks(texture, component, weights, rows: slice, block_y: int, block_x: int) -> tuple[np.ndarray, np.ndarray]:
    """Means over blocks of some rows of texels, and of their squares: (h, w) float64 each."""
    values = _luminance(texture, component, weights, rows).astype(np.float64)
    if block_y == 1 and block_x == 1:
        return values, values * values
    height, width = (-(-size // block) * block for size, block in zip(values.shape, (block_y, block_x), strict=True))
    values = np.pad(values, ((0, height - values.shape[0]), (0, width - values.shape[1])), mode="edge")
    values = values.reshape(height // block_y, block_y, width // block_x, block_x)
    return values.mean(axis=(1, 3)), np.einsum("ybxc,ybxc->yx", values, values) / (block_y * block_x)


def _summed(values: np.ndarray, extension: str) -> np.ndarray:
    """Sums (h + 1, w + 1) float64 over rows and columns before each place."""
    if extension == "MIRROR":
        values = np.concatenate([values, values[::-1]])
        values = np.concatenate([values, values[:, ::-1]], axis=1)
    table = np.zeros((values.shape[0] + 1, values.shape[1] + 1))
    np.cumsum(np.cumsum(values, axis=0), axis=1, out=table[1:, 1:])
    return table


def _box(table: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Sums (n,) over columns and rows from ``first`` to before ``last`` (n, 2) of what ``table`` is of, repeated without end."""
    (x0, y0), (x1, y1) = first.T, last.T
    return _prefix(table, x1, y1) - _prefix(table, x0, y1) - _prefix(table, x1, y0) + _prefix(table, x0, y0)


def _prefix(table: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    across, x = np.divmod(x, table.shape[1] - 1)
    up, y = np.divmod(y, table.shape[0] - 1)
    return across * up * table[-1, -1] + across * table[y, -1] + up * table[-1, x] + table[y, x]
