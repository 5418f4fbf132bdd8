"""EXR files with metadata: what bundles, exports and pictures are written as, and one clear error per cause.

Compression is ZIP and every attribute is fixed, so the same pixels give the same bytes. The format itself is ``exr_codec``.
"""

import json
from pathlib import Path

import numpy as np

from ..errors import BakeError
from .exr_codec import MAGIC, DamagedFile, UnknownLayout, decode, encode
from .files import disk_error

METADATA = "rtgi:json"

_REMEDY = "bake again or restore the file"


def write_exr(path, channels: dict[str, np.ndarray], metadata: dict) -> None:
    """Write ``channels`` (name → (height, width), scanline 0 at the top) as one file with ``metadata`` in `rtgi:json`.

    float16 is stored as half, anything else as float. Raises BakeError naming the file if the disk refuses.
    """
    planes = {name: pixels if pixels.dtype == np.float16 else pixels.astype(np.float32, copy=False)
              for name, pixels in channels.items()}
    # `type` is for multi-part files only; some readers look for it all the same.
    data = encode(planes, {METADATA: json.dumps(metadata, separators=(",", ":"), allow_nan=False), "type": "scanlineimage"})
    try:
        Path(path).write_bytes(data)
    except OSError as error:
        raise disk_error(path, error) from error


def read_exr(path) -> tuple[dict[str, np.ndarray], dict]:
    """Read a file of ``write_exr``: (name → (height, width) float16 or float32, metadata). Raises BakeError naming a file that
    is missing, cut short, damaged or not one of ours."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise disk_error(path, error, doing="read") from error
    if data[:len(MAGIC)] != MAGIC[:len(data)]:
        raise BakeError(f"{path} is not an EXR file", _REMEDY)
    try:
        planes, texts = decode(data)
        metadata = json.loads(texts.get(METADATA, "null"))
    except UnknownLayout as error:
        raise BakeError(f"{path} was not written by rtgi ({error})", _REMEDY) from error
    except (DamagedFile, json.JSONDecodeError) as error:
        raise BakeError(f"{path} is cut short or damaged", _REMEDY) from error
    if not isinstance(metadata, dict):
        raise BakeError(f"{path} was not written by rtgi", _REMEDY)
    return planes, metadata
