"""Single-part float32 EXR files through the OpenEXR package (its numpy interface, the same from 3.3 to 3.5).

Compression is ZIP and every attribute is fixed, so the same pixels give the same bytes. OpenEXR ignores numpy strides and
would write garbage from a slice or a flipped view: every array goes through ``ascontiguousarray`` first. It also loses the
error of a disk that fills up while it closes a file: every file's length is checked against its own chunk table.
Sources: https://openexr.com/en/latest/python.html, https://openexr.com/en/latest/OpenEXRFileLayout.html
"""

import json
import struct
from pathlib import Path

import numpy as np
import OpenEXR

from ..errors import BakeError
from .files import disk_error

METADATA = "rtgi:json"

_MAGIC = b"v/1\x01"
_ZIP_LINES = 16
_REMEDY = "bake again or restore the file"


def write_exr(path, channels: dict[str, np.ndarray], metadata: dict) -> None:
    """Write ``channels`` (name → (height, width), scanline 0 at the top) as one file with ``metadata`` in `rtgi:json`.

    Raises BakeError naming the file if the disk refuses.
    """
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        METADATA: json.dumps(metadata, separators=(",", ":"), allow_nan=False),
    }
    planes = {name: np.ascontiguousarray(pixels, dtype=np.float32) for name, pixels in channels.items()}
    try:
        OpenEXR.File(header, planes).write(str(path))
    except RuntimeError as error:
        raise disk_error(path, error) from error
    if not _is_complete(path):
        raise BakeError(f"cannot write {path}, no space left on device or it was taken away",
                        "free some space on that disk or write somewhere else")


def read_exr(path) -> tuple[dict[str, np.ndarray], dict]:
    """Read a file of ``write_exr``: (name → (height, width) float32, metadata). Raises BakeError naming a file that is
    missing, cut short, damaged or not one of ours."""
    path = Path(path)
    try:
        with open(path, "rb") as file:
            magic = file.read(len(_MAGIC))
    except OSError as error:
        raise disk_error(path, error, doing="read") from error
    if magic != _MAGIC[:len(magic)]:
        raise BakeError(f"{path} is not an EXR file", _REMEDY)
    # OpenEXR prints to both streams about a file that is cut short, before it raises.
    if not _is_complete(path):
        raise BakeError(f"{path} is cut short or damaged", _REMEDY)
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            planes = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
            metadata = json.loads(file.header().get(METADATA, "null"))
    except (RuntimeError, ValueError) as error:
        # 3.3 raises at once; 3.5 prints a warning and then has no part to give.
        raise BakeError(f"{path} is cut short or damaged", _REMEDY) from error
    if not isinstance(metadata, dict) or any(plane.dtype != np.float32 for plane in planes.values()):
        raise BakeError(f"{path} was not written by rtgi", _REMEDY)
    return planes, metadata


def _is_complete(path) -> bool:
    """True if the file ends where the last chunk of its table does (ZIP packs 16 scanlines to a chunk)."""
    try:
        with open(path, "rb") as file:
            file.seek(8)
            lines = 0
            while name := _text(file):
                _text(file)
                value = file.read(struct.unpack("<i", file.read(4))[0])
                if name == b"dataWindow":
                    _, top, _, bottom = struct.unpack("<4i", value)
                    lines = bottom - top + 1
            chunks = -(-lines // _ZIP_LINES)
            last = max(struct.unpack(f"<{chunks}Q", file.read(8 * chunks)))
            file.seek(last)
            _, packed = struct.unpack("<2i", file.read(8))
            return file.seek(0, 2) == last + 8 + packed
    except (OSError, ValueError, struct.error):
        return False


def _text(file) -> bytes:
    """The bytes up to the next zero. Raises ValueError at the end of the file."""
    text = bytearray()
    while (byte := file.read(1)) != b"\0":
        if not byte:
            raise ValueError("the header does not end")
        text += byte
    return bytes(text)
