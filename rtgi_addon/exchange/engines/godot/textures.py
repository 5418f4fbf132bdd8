"""Probe volumes as EXR flipbooks that Godot imports as Texture3D, with the import settings beside them.

probes.exr is RGBA of half floats, eight blocks of nz slices: (way from lattice point to probe, 1 if it holds light); SH of
radiance, red 0-3, red 4-7, green 0-3, green 4-7, blue 0-3, blue 4-7; (red 8, green 8, blue 8, 0). distances.exr is RG of float32:
their variance is a difference of the two, for which halves are too coarse.
"""

from pathlib import Path

import numpy as np

from ....errors import BakeError
from ...exr import write_exr
from ...flipbook import Tiles, layout, to_sheet
from ..base import write_text
from ..volumes import ExportVolume, to_half

PROBES, DISTANCES = "probes.exr", "distances.exr"
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


def write_textures(folder: Path, volume: ExportVolume) -> None:
    """Write the textures of ``volume`` into ``folder``/``volume.folder``. Raises BakeError for one that no 3D texture holds."""
    target = folder / volume.folder
    target.mkdir(parents=True)
    _write(target / PROBES, _probes(volume), "RGBA", volume)
    _write(target / DISTANCES, _distances(volume), "RG", volume)


def _probes(volume: ExportVolume) -> np.ndarray:
    """(8·nz, ny, nx, 4) float16."""
    blocks = np.zeros((8, *volume.live.shape, 4), np.float32)
    blocks[0, ..., :3], blocks[0, ..., 3] = volume.offset, volume.live
    for channel in range(3):
        blocks[1 + 2 * channel] = volume.sh[..., 0:4, channel]
        blocks[2 + 2 * channel] = volume.sh[..., 4:8, channel]
        blocks[7, ..., channel] = volume.sh[..., 8, channel]
    return to_half(blocks.reshape(-1, *blocks.shape[2:]), f"a probe of volume {volume.name!r}")


def _distances(volume: ExportVolume) -> np.ndarray:
    """(nz, ny·(T + 2), nx·(T + 2), 2) float32."""
    nz, ny, nx, width, _, _ = volume.moments.shape
    return volume.moments.transpose(0, 1, 3, 2, 4, 5).reshape(nz, ny * width, nx * width, 2)


def _write(path: Path, slices: np.ndarray, channels: str, volume: ExportVolume) -> None:
    depth, height, width = slices.shape[:3]
    if max(depth, height, width) > MAX_SIDE:
        raise BakeError(f"volume {volume.name!r} makes a 3D texture of {width} x {height} x {depth}, and {MAX_SIDE} is the most "
                        "that every driver has", "lower its resolution or split it into several volumes")
    tiles: Tiles = layout((width, height, depth))
    sheet = to_sheet(slices, tiles)
    write_exr(path, {name: sheet[..., index] for index, name in enumerate(channels)}, {"volume": volume.name})
    write_text(path.with_name(path.name + ".import"), _IMPORT.format(columns=tiles.columns, rows=tiles.rows))
