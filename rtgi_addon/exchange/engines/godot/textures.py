"""Probe volumes as EXR flipbooks that Godot imports as Texture3D, with the import settings beside them.

probes.exr is RGBA of half floats, eight blocks of nz slices: (way from lattice point to probe, its scale, negative if it holds no
light); SH of radiance over that scale, red 0-3, red 4-7, green 0-3, green 4-7, blue 0-3, blue 4-7; (red 8, green 8, blue 8, 0).
Scales are powers of two: Godot reads halves below 2^-14 as 0, which of dim probes would be much. distances.exr is RG of float32:
their variance is a difference of the two, for which halves are too coarse. nodes.exr, of a scattered volume, is RGBA of float32:
what each of its nodes names (scene/scattered.py); its probes are a list, whose first block has their ways from the volume's centre.
"""

import re
from pathlib import Path

import numpy as np

from ....errors import BakeError
from ...exr import write_exr
from ...flipbook import Tiles, layout, to_sheet
from ..base import write_text
from ..volumes import ExportVolume, to_half

PROBES, DISTANCES, NODES = "probes.exr", "distances.exr", "nodes.exr"
# Blocks of slices in PROBES.
_BLOCKS = 8
# The exponents of the least scale of a probe and of what its largest number is to be at most, a sixteenth of what halves hold.
_LEAST_SCALE, _LARGEST = -14, 12
# The end of an import record's name.
IMPORT = ".import"
# The least side of 3D textures that Vulkan and desktop OpenGL drivers have.
MAX_SIDE = 2048

_IMPORT = """\
[remap]

importer="3d_texture"
type="CompressedTexture3D"

[params]

compress/mode=0
compress/high_quality=false
compress/lossy_quality=0.7
compress/hdr_compression=0
compress/channel_pack=0
mipmaps/generate=false
mipmaps/limit=-1
slices/horizontal={columns}
slices/vertical={rows}
"""


_SLICES = re.compile(r"^(slices/(?:horizontal|vertical))=(\d+)$", re.MULTILINE)


def write_textures(folder: Path, volume: ExportVolume) -> None:
    """Write the textures of ``volume`` into ``folder``/``volume.folder``. Raises BakeError for one that no 3D texture holds."""
    target = folder / volume.folder
    _write(target / PROBES, _probes(volume), "RGBA", volume)
    _write(target / DISTANCES, _distances(volume), "RG", volume)
    if volume.words is not None:
        _write(target / NODES, volume.words, "RGBA", volume)


def probes_sheet(volume: ExportVolume) -> tuple[int, int]:
    """Width and height of the picture in which the slices of PROBES lie."""
    nx, ny, nz = volume.resolution
    tiles = layout((nx, ny, _BLOCKS * nz))
    return nx * tiles.columns, ny * tiles.rows


def blend_import(theirs: bytes, ours: bytes) -> bytes | None:
    """The import record ``theirs`` with the slices of ``ours``; None unless both import a 3D texture."""
    both = [record.decode("utf-8", "replace") for record in (theirs, ours)]
    slices = [dict(_SLICES.findall(record)) for record in both]
    if any('importer="3d_texture"' not in record for record in both) or slices[0].keys() != slices[1].keys():
        return None
    return _SLICES.sub(lambda found: f"{found[1]}={slices[1][found[1]]}", both[0]).encode()


def _probes(volume: ExportVolume) -> np.ndarray:
    """(8·nz, ny, nx, 4) float16."""
    blocks = np.zeros((_BLOCKS, *volume.live.shape, 4), np.float32)
    exponent = np.frexp(np.abs(volume.sh).max(axis=(3, 4)))[1]
    scale = np.exp2(np.clip(exponent - _LARGEST, _LEAST_SCALE, 0)).astype(np.float32)
    coefficients = volume.sh / scale[..., None, None]
    blocks[0, ..., :3], blocks[0, ..., 3] = volume.offset, np.where(volume.live, scale, -scale)
    for channel in range(3):
        blocks[1 + 2 * channel] = coefficients[..., 0:4, channel]
        blocks[2 + 2 * channel] = coefficients[..., 4:8, channel]
        blocks[7, ..., channel] = coefficients[..., 8, channel]
    return to_half(blocks.reshape(-1, *blocks.shape[2:]), f"a probe of volume {volume.name!r}")


def _distances(volume: ExportVolume) -> np.ndarray:
    """(nz, ny·(T + 2), nx·(T + 2), 2) float32."""
    nz, ny, nx, width, _, _ = volume.moments.shape
    return volume.moments.transpose(0, 1, 3, 2, 4, 5).reshape(nz, ny * width, nx * width, 2)


def require_size(shape, what: str) -> None:
    """Raise BakeError unless a 3D texture of ``shape`` (depth, height, width) is one that every driver has; ``what`` makes it."""
    depth, height, width = shape
    if max(depth, height, width) > MAX_SIDE:
        raise BakeError(f"{what} makes a 3D texture of {width} x {height} x {depth}, and {MAX_SIDE} is the most "
                        "that every driver has", "lower its resolution or split it into several volumes")


def import_record(tiles: Tiles) -> str:
    """The import record of a flipbook of so many ``tiles``."""
    return _IMPORT.format(columns=tiles.columns, rows=tiles.rows)


def _write(path: Path, slices: np.ndarray, channels: str, volume: ExportVolume) -> None:
    depth, height, width = slices.shape[:3]
    require_size((depth, height, width), f"volume {volume.name!r}")
    tiles: Tiles = layout((width, height, depth))
    sheet = to_sheet(slices, tiles)
    write_exr(path, {name: sheet[..., index] for index, name in enumerate(channels)}, {"volume": volume.name})
    write_text(path.with_name(path.name + IMPORT), import_record(tiles))
