"""Arrays to textures and back.

Blender's module reads 3D textures and layers wrongly before 5.2 and has no storage buffers, so everything is a 2D texture of
floats: lists are folded into rows (see `packing`), volumes into tiles (see `atlas`).
"""

import gpu
import numpy as np

from ..errors import BakeError

CHANNELS = {"R32F": 1, "RGBA32F": 4, "RGBA16F": 4, "RGBA8": 4}


def upload(values: np.ndarray, format: str | None = None, name: str = "a texture") -> gpu.types.GPUTexture:
    """A texture from ``values`` (h, w) or (h, w, 4), row 0 at the bottom; float32 R32F or RGBA32F unless ``format`` says otherwise
    (a normalized format takes floats from 0 to 1). Raises BakeError that gives its ``name`` beyond the GPU's largest texture."""
    values = np.ascontiguousarray(values, np.float32)
    height, width = values.shape[:2]
    _require_size(width, height, name)
    format = format or ("R32F" if values.ndim == 2 else "RGBA32F")
    # The buffer is the array itself: both must live until the texture has taken it in, which is when this returns.
    return gpu.types.GPUTexture((width, height), format=format, data=gpu.types.Buffer("FLOAT", values.size, values))


def empty(width: int, height: int, format: str = "RGBA32F") -> gpu.types.GPUTexture:
    """A texture of zeros. Raises BakeError beyond the GPU's largest texture."""
    _require_size(width, height)
    texture = gpu.types.GPUTexture((width, height), format=format)
    if not format.startswith("DEPTH"):
        texture.clear(format="FLOAT", value=(0.0,) * CHANNELS[format])
    return texture


def download(texture: gpu.types.GPUTexture) -> np.ndarray:
    """(h, w) or (h, w, 4) float32, row 0 at the bottom."""
    channels = CHANNELS[texture.format]
    buffer = texture.read()
    # With the dimensions that read() gives, the buffer protocol hands out rows in the wrong order.
    buffer.dimensions = texture.width * texture.height * channels
    shape = (texture.height, texture.width) if channels == 1 else (texture.height, texture.width, channels)
    return np.frombuffer(buffer, np.float32).reshape(shape).copy()


def _require_size(width: int, height: int, name: str = "a texture") -> None:
    limit = gpu.capabilities.max_texture_size_get()
    if max(width, height) > limit:
        raise BakeError(f"{name} of {width} × {height} is larger than this GPU's limit of {limit}",
                        "use a lower resolution, or --device cpu")
