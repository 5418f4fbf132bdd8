"""Images of skies, read without Blender: Radiance .hdr and OpenEXR with ZIP or no compression, scene-linear.

Source of the former: G. Ward, "Real Pixels", Graphics Gems II, 1991, and Radiance's color.c: four bytes a pixel, mantissas and one
exponent, in scanlines whose four components are each run-length encoded.
"""

from pathlib import Path

import numpy as np

from ..errors import BakeError, UsageError
from ..storage.reading import read_file
from .exr_codec import DamagedFile, UnknownLayout, decode

SUFFIXES = (".hdr", ".exr")
# The largest image that is read, and the widest line that Radiance encodes.
_MAX_BYTES, _MAX_RUN_WIDTH = 1 << 30, 0x7FFF


def read_sky(path) -> np.ndarray:
    """The pixels (h, w, 3) float32 of the equirectangular image at ``path``, row 0 at the bottom as ``scene.World`` has it.

    Raises UsageError for another kind of file, BakeError for one that is missing, damaged or not twice as wide as high.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"{path.name} is no image of a sky that can be read without Blender",
                         f"give one that ends in {' or '.join(SUFFIXES)}, or R,G,B")
    data = read_file(path, _MAX_BYTES)
    pixels = _hdr(data, path) if path.suffix.lower() == ".hdr" else _exr(data, path)
    if not np.isfinite(pixels).all() or pixels.min() < 0:
        raise BakeError(f"{path} holds radiance that is negative or not finite", "clean the image")
    if pixels.shape[1] != 2 * pixels.shape[0]:
        height, width = pixels.shape[:2]
        raise BakeError(f"{path} has {width} × {height} pixels", "give an equirectangular image, twice as wide as high")
    return np.ascontiguousarray(pixels[::-1], np.float32)


def _exr(data: bytes, path: Path) -> np.ndarray:
    try:
        planes, _ = decode(data)
    except UnknownLayout as error:
        raise BakeError(f"{path} is an EXR of a kind that is not read here ({error})",
                        "save it as one part with ZIP compression, or as .hdr") from error
    except DamagedFile as error:
        raise BakeError(f"{path} is cut short or damaged ({error})", "restore the file") from error
    if not set("RGB") <= planes.keys():
        raise BakeError(f"{path} has no channels R, G and B", "save it as one layer of colours")
    return np.stack([planes[letter].astype(np.float32) for letter in "RGB"], axis=-1)


def _hdr(data: bytes, path: Path) -> np.ndarray:
    broken = BakeError(f"{path} is cut short, damaged or no Radiance image", "restore the file")
    head, mark, rest = data.partition(b"\n\n")
    size, mark_of_size, body = rest.partition(b"\n")
    words = size.split()
    if not (head.startswith((b"#?RADIANCE", b"#?RGBE")) and mark and mark_of_size) or b"32-bit_rle_rgbe" not in head:
        raise broken
    if len(words) != 4 or words[0] != b"-Y" or words[2] != b"+X" or not (words[1].isdigit() and words[3].isdigit()):
        raise BakeError(f"{path} is turned or mirrored ({size.decode('ascii', 'replace')})", "save it with rows from top to bottom")
    height, width = int(words[1]), int(words[3])
    if not height or not width or height > 1 << 16 or width > 1 << 16 or len(body) * 127 < 2 * height * width:
        raise broken
    try:
        rgbe = _scanlines(memoryview(body), height, width)
    except (IndexError, ValueError) as error:
        raise broken from error
    scale = np.ldexp(np.float32(1.0), rgbe[..., 3:].astype(np.int32) - 136)
    return np.where(rgbe[..., 3:] > 0, (rgbe[..., :3] + np.float32(0.5)) * scale, np.float32(0.0))


def _scanlines(body: memoryview, height: int, width: int) -> np.ndarray:
    """(h, w, 4) uint8. Raises IndexError or ValueError for lines that are not as long as they should be."""
    if not (8 <= width <= _MAX_RUN_WIDTH and body[0] == 2 and body[1] == 2 and not body[2] & 0x80):
        return np.frombuffer(body, np.uint8).reshape(height, width, 4)
    lines, at = np.empty((height, 4, width), np.uint8), 0
    for row in range(height):
        if body[at] != 2 or body[at + 1] != 2 or body[at + 2] << 8 | body[at + 3] != width:
            raise ValueError("a scanline begins otherwise")
        at += 4
        for component in range(4):
            column = 0
            while column < width:
                count = body[at]
                if count > 128:
                    count, values, at = count - 128, body[at + 1], at + 2
                else:
                    values, at = np.frombuffer(body[at + 1:at + 1 + count], np.uint8), at + 1 + count
                if count == 0 or column + count > width:
                    raise ValueError("a run is too long")
                lines[row, component, column:column + count] = values
                column += count
    return lines.transpose(0, 2, 1)
