"""The images of one volume of a bundle (docs/formats.md), one after the other, so that a volume may be larger than memory."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..errors import BakeError
from ..techniques.base import GridFacts
from . import flipbook
from .exr import write_exr, write_exr_strips
from .schema import FITTED, MEASURED, SAMPLE_PLACEMENT, image_header


def write_volume(bundle: Path, folder: str, grid: GridFacts) -> dict:
    """Write one volume's images into ``bundle``/``folder``, one after the other, and return its entry for the manifest."""
    volume = grid.volume
    resolution = [int(n) for n in volume.resolution]
    cell, slices = grid.visibility_size, resolution[2]
    tiles, visibility_tiles = flipbook.layout(resolution), flipbook.layout(resolution, cell)
    entry = {
        "name": volume.name,
        "resolution": resolution,
        "world_from_local": np.asarray(volume.world_from_local, np.float64).tolist(),
        "sample_placement": SAMPLE_PLACEMENT,
        "fitted": bool(volume.fitted),
        "sh_order": grid.order,
        "tiles": tiles._asdict(),
        "sh": [f"{folder}/sh{index}.exr" for index in range((grid.order + 1) ** 2)],
        "coefficients": FITTED if grid.fitted else MEASURED,
        "visibility": f"{folder}/visibility.exr",
        "visibility_size": cell,
        "visibility_tiles": visibility_tiles._asdict(),
        "validity": f"{folder}/validity.exr",
    }

    def write(key: str, names: str, sheet: np.ndarray, coefficient: int | None = None) -> None:
        name = entry["sh"][coefficient] if key == "sh" else entry[key]
        write_exr(bundle / name, {letter: sheet[..., index] for index, letter in enumerate(names)},
                  image_header(entry, key, coefficient))

    def finite(values: np.ndarray, kind: str, first_slice: int = 0) -> np.ndarray:
        bad = ~np.isfinite(values).reshape(*values.shape[:3], -1).all(axis=-1)
        if bad.any():
            z, y, x = (int(index) for index in np.argwhere(bad)[0])
            raise BakeError(f"volume {volume.name!r}: {kind} is not finite at {int(bad.sum())} probes, first at "
                            f"{(x, y, z + first_slice)}", "look for infinite light strengths in the scene, and report this with "
                            "the file")
        return values

    def strips() -> Iterator[dict[str, np.ndarray]]:
        # A row of tiles at a time: of all images this is by far the largest.
        for first in range(0, slices, visibility_tiles.columns):
            last = min(first + visibility_tiles.columns, slices)
            sheet = flipbook.octahedral_to_sheet(finite(grid.visibility_slices(first, last), "visibility", first),
                                                 flipbook.Tiles(visibility_tiles.columns, 1))
            yield {"R": sheet[..., 0], "G": sheet[..., 1]}

    for index in range(len(entry["sh"])):
        write("sh", "RGB", flipbook.to_sheet(finite(grid.coefficient(index), "sh"), tiles), index)
    size = visibility_tiles.rows * resolution[1] * cell, visibility_tiles.columns * resolution[0] * cell
    write_exr_strips(bundle / entry["visibility"], "RG", size, strips(), image_header(entry, "visibility"))
    write("validity", "Y", flipbook.to_sheet(finite(grid.validity, "validity")[..., None], tiles))
    if np.any(grid.offset_world != 0):
        entry["offset"] = f"{folder}/offset.exr"
        write("offset", "RGB", flipbook.to_sheet(finite(grid.offset_world, "offset_world"), tiles))
    if not np.all(np.isnan(grid.standard_error)):
        entry["standard_error"] = f"{folder}/standard_error.exr"
        write("standard_error", "Y", flipbook.to_sheet(grid.standard_error[..., None], tiles))
    if volume.scattered is not None:
        nodes = [int(n) for n in volume.nodes]
        entry["index"] = {"file": f"{folder}/index.exr", "resolution": nodes, "tiles": flipbook.layout(nodes)._asdict()}
        sheet = flipbook.to_sheet(volume.scattered.index.astype(np.float32), flipbook.Tiles(**entry["index"]["tiles"]))
        write_exr(bundle / entry["index"]["file"], {letter: sheet[..., slot] for slot, letter in enumerate("RGBA")},
                  image_header(entry, "index"))
    return entry
