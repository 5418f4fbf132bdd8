"""Single-part float32 EXR files through the OpenEXR package (its numpy interface, the same from 3.3 to 3.5).

Compression is ZIP and every attribute is fixed, so the same pixels give the same bytes. OpenEXR ignores numpy strides and
would write garbage from a slice or a flipped view: every array goes through ``ascontiguousarray`` first.
Source: https://openexr.com/en/latest/python.html
"""

import json
from pathlib import Path

import numpy as np
import OpenEXR

from ..errors import BakeError
from .files import disk_error

METADATA = "rtgi:json"


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


def read_exr(path) -> tuple[dict[str, np.ndarray], dict]:
    """Read a file of ``write_exr``: (name → (height, width) float32, metadata). Raises BakeError naming a file that is
    missing, cut short, damaged or not one of ours."""
    path = Path(path)
    try:
        with open(path, "rb") as file:
            magic = file.read(4)
    except OSError as error:
        raise disk_error(path, error, doing="read") from error
    if magic != b"v/1\x01":
        raise BakeError(f"{path} is not an EXR file", "bake again or restore the file")
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            planes = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
            metadata = json.loads(file.header().get(METADATA, "null"))
    except (RuntimeError, ValueError) as error:
        # 3.3 raises at once; 3.5 prints a warning and then has no part to give.
        raise BakeError(f"{path} is cut short or damaged", "bake again or restore the file") from error
    if not isinstance(metadata, dict) or any(plane.dtype != np.float32 for plane in planes.values()):
        raise BakeError(f"{path} was not written by rtgi", "bake again or restore the file")
    return planes, metadata
