"""EXR files with metadata: what bundles, exports and pictures are written as, and one clear error per cause.

Compression is ZIP and every attribute is fixed, so the same pixels give the same bytes. The format itself is ``exr_codec``.
"""

import json
from collections.abc import Iterable

import numpy as np

from ..errors import BakeError
from ..storage.files import disk_error
from ..storage.parse import Refused, parse_json
from ..storage.reading import read_file
from ..storage.writing import claim, write_file
from .exr_codec import MAGIC, DamagedFile, UnknownLayout, decode, encode, encode_strips
from .flipbook import MAX_SIDE

METADATA = "rtgi:json"
# Pictures have red, green, blue and alpha; beside pixels a file has attributes, of which the metadata is the longest.
_MAX_CHANNELS, _MAX_HEADER = 4, 2**16

_REMEDY = "bake again or restore the file"


def write_exr(path, channels: dict[str, np.ndarray], metadata: dict) -> None:
    """Write ``channels`` (name → (height, width), scanline 0 at the top) as one file with ``metadata`` in `rtgi:json`.

    float16 is stored as half, anything else as float. Raises BakeError naming the file if the disk refuses.
    """
    planes = {name: pixels if pixels.dtype == np.float16 else pixels.astype(np.float32, copy=False)
              for name, pixels in channels.items()}
    data = encode(planes, _texts(metadata))
    try:
        write_file(path, data)
    except OSError as error:
        raise disk_error(path, error) from error


def write_exr_strips(path, letters: str, size: tuple[int, int], strips: Iterable[dict[str, np.ndarray]], metadata: dict) -> None:
    """As ``write_exr``, into a workplace's ``new``, of an image of ``size`` (height, width) in float with the channels ``letters``,
    which comes in ``strips`` from the top: the same bytes, and no more in memory than a strip."""
    try:
        with open(claim(path), "wb") as file:
            encode_strips(file, dict.fromkeys(letters, np.dtype(np.float32)), size, _texts(metadata), strips)
    except OSError as error:
        raise disk_error(path, error) from error


def _texts(metadata: dict) -> dict[str, str]:
    # `type` is for multi-part files only; some readers look for it all the same.
    return {METADATA: json.dumps(metadata, separators=(",", ":"), allow_nan=False), "type": "scanlineimage"}


def read_exr(path, size: tuple[int, int] | None = None) -> tuple[dict[str, np.ndarray], dict]:
    """Read a file of ``write_exr``: (name → (height, width) float16 or float32, metadata). Raises BakeError naming a file that
    is missing, cut short, damaged, not one of ours, or not of ``size`` (height, width)."""
    return decode_exr(read_file(path, largest_file(size)), path, size)


def largest_file(size: tuple[int, int] | None = None) -> int:
    """How many bytes a file of ``write_exr`` of ``size`` (height, width; None: any) may have."""
    height, width = size or (MAX_SIDE, MAX_SIDE)
    # Chunks that do not shrink are stored as they are, each after 16 bytes of its own.
    return height * (_MAX_CHANNELS * 4 * width + 16) + _MAX_HEADER


def decode_exr(data: bytes, path, size: tuple[int, int] | None = None) -> tuple[dict[str, np.ndarray], dict]:
    """As ``read_exr``, of the bytes of the file at ``path``."""
    if data[:len(MAGIC)] != MAGIC[:len(data)]:
        raise BakeError(f"{path} is not an EXR file", _REMEDY)
    try:
        planes, texts = decode(data, size)
        metadata = parse_json(texts.get(METADATA, "null").encode())
    except UnknownLayout as error:
        raise BakeError(f"{path} was not written by rtgi ({error})", _REMEDY) from error
    except (DamagedFile, Refused) as error:
        raise BakeError(f"{path} is cut short or damaged ({error})", _REMEDY) from error
    if not isinstance(metadata, dict):
        raise BakeError(f"{path} was not written by rtgi", _REMEDY)
    return planes, metadata


def require_image(path, planes: dict[str, np.ndarray], letters: str, header: dict, expected: dict, manifest: str) -> None:
    """Raise BakeError unless the image at ``path`` has the channels ``letters`` and its ``header`` repeats what the file
    ``manifest`` says of it, ``expected``."""
    if set(planes) != set(letters):
        raise BakeError(f"{path} has channels {', '.join(sorted(planes))} instead of {', '.join(letters)}", _REMEDY)
    for word, value in expected.items():
        if header.get(word) != value:
            raise BakeError(f"{path} does not belong to {manifest}, they differ in {word}", _REMEDY)
