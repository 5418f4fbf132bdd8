"""Write 8-bit PNG with nothing but zlib, so that a picture needs no package that Blender lacks.

Source: ISO/IEC 15948, "Portable Network Graphics"; every row is stored with the filter 'Up', which suits smooth renders.
"""

import struct
import zlib
from pathlib import Path

import numpy as np

from ..errors import BakeError
from .files import disk_error
from .reading import read_file
from .writing import write_file

_SIGNATURE = b"\x89PNG\r\n\x1a\n"


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
        _SIGNATURE, _chunk(b"IHDR", header), _chunk(b"sRGB", b"\x00"),
        _chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)), _chunk(b"IEND", b""),
    ])
    try:
        return write_file(path, content)
    except OSError as error:
        raise disk_error(path, error) from error


def require_whole_png(path, size: tuple[int, int]) -> None:
    """Raise BakeError unless the PNG at ``path``, from whoever wrote it, is whole and of ``size`` (height, width)."""
    data = read_file(path, 1 << 36)
    place, kinds, pixels = len(_SIGNATURE), [], zlib.decompressobj()
    whole, found = data.startswith(_SIGNATURE), 0
    while whole and place < len(data):
        length, kind = struct.unpack_from(">I4s", data, place) if place + 8 <= len(data) else (len(data), b"")
        body = data[place + 8:place + 8 + length]
        place += 12 + length
        whole = place <= len(data) and data[place - 4:place] == struct.pack(">I", zlib.crc32(kind + body))
        kinds.append(kind)
        if whole and kind == b"IHDR":
            whole = length == 13 and struct.unpack_from(">II", body) == size[::-1]
        elif whole and kind == b"IDAT":
            try:
                found += len(pixels.decompress(body))
            except zlib.error:
                whole = False
    if not whole or kinds[:1] != [b"IHDR"] or kinds[-1:] != [b"IEND"] or not pixels.eof or not found:
        raise BakeError(f"the picture {Path(path).name} did not get to the disk whole",
                        "free some space on that disk or write somewhere else")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
