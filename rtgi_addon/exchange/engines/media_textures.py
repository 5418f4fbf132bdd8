"""Media as the slices of 3D textures."""

import numpy as np

from .media import EngineMedia, EngineMedium


def ambient_blocks(media: EngineMedia) -> np.ndarray:
    """(7·nz, ny, nx, 4) float16: red 0-3, red 4-7, green 0-3, green 4-7, blue 0-3, blue 4-7, the eighths of all three."""
    blocks = np.zeros((7, *media.ambient.shape[:3], 4), np.float16)
    for channel in range(3):
        blocks[2 * channel] = media.ambient[..., 0:4, channel]
        blocks[2 * channel + 1] = media.ambient[..., 4:8, channel]
        blocks[6, ..., channel] = media.ambient[..., 8, channel]
    return blocks.reshape(-1, *blocks.shape[2:])


def cell_blocks(box: EngineMedium) -> np.ndarray:
    """(nz, ny, nx, 1) float16 of density, or (3·nz, ny, nx, 4) of scattering, absorption and emission."""
    if len(box.cells) == 1:
        return box.cells[0, ..., :1]
    padded = np.zeros((*box.cells.shape[:4], 4), np.float16)
    padded[..., :3] = box.cells
    return padded.reshape(-1, *padded.shape[2:])
