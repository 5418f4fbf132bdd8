"""Write 8-bit PNG with nothing but zlib, so that a picture needs no package that Blender lacks.

Source: ISO/IEC 15948, "Portable Network Graphics"; every row is stored with the filter 'Up', which suits smooth renders.
"""

import contextlib
import os
import struct
import zlib
from pathlib import Path

import numpy as np

from ..errors import BakeError


def write_png(path, pixels: np.ndarray) -> Path:
    """Write ``pixels`` (h, w, 3) uint8, row 0 at the top, sRGB-encoded, replacing ``path`` in one step. Raises BakeError."""
    pixels = np.ascontiguousarray(pixels, np.uint8)
    height, width, channels = pixels.shape
    if channels != 3:
        raise ValueError(f"{channels} channels; a picture has 3")
    rows = pixels.reshape(height, width * 3)
    filtered = np.empty((height, 1 + width * 3), np.uint8)
    filtered[:, 0] = 2
    filtered[0, 1:] = rows[0]
    filtered[1:, 1:] = rows[1:] - rows[:-1]
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    content = b"".join([
        b"\x89PNG\r\n\x1a\n", _chunk(b"IHDR", header), _chunk(b"sRGB", b"\x00"),
        _chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)), _chunk(b"IEND", b""),
    ])
    path = Path(path)
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(content)
        os.replace(partial, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise BakeError(f"cannot write the picture {path} ({error.strerror})", "choose another place or free space") from error
    return path


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
