"""What a light atlas makes of any light, in a bundle (docs/formats.md): images in which every texel is a small matrix.

```
OUT/atlas/transfer/sky0.exr … sky4.exr      R G B what surfaces reflect of a sky's harmonics, A what is seen of them
OUT/atlas/transfer/suns0.exr … suns4.exr    the same of suns from the directions of a grid
OUT/atlas/transfer/lights0.exr …            R G B, float: the light of each of the bake's own lights
```

One image for each number that is kept of a texel: the four coefficients, and irradiance.
"""

from pathlib import Path

import numpy as np

from ..effects.atlas.matrices import LEAST_SIDE, NUMBERS, AtlasTransfer
from ..errors import BakeError
from ..numerics import dome
from ..storage.parse import file_name, flag, listing, number, record, require_inside, whole
from ..techniques.transfer.stored import halves
from .exr import read_exr, require_image, write_exr
from .flipbook import MAX_SIDE
from .schema import RESTORE

_FILES = listing(file_name, NUMBERS)
TRANSFER = record({"sky_order": whole(0, 8), "sun_side": whole(0, 1024), "sun_below": flag, "lights": whole(0, 1024), "sky": _FILES,
                   "half_error": number(0.0)}, {"suns": _FILES, "light": _FILES})


def write_matrices(bundle: Path, folder: str, transfer: AtlasTransfer) -> dict:
    """Write ``transfer`` into ``folder`` of the folder ``bundle`` and return its entry of the index. Raises BakeError for values
    that are not finite, and for a sheet that is larger than an image may be; OSError."""
    (bundle / folder).mkdir(exist_ok=True)
    off = power = 0.0
    entry = {"sky_order": transfer.sky_order, "sun_side": transfer.sun_side, "sun_below": transfer.sun_below,
             "lights": int(transfer.lights.shape[-1]), "sky": _names(folder, "sky")}
    rounded = {"sky": (*transfer.bounce, transfer.sky)}
    if transfer.follows_suns:
        entry["suns"] = _names(folder, "suns")
        rounded["suns"] = (*transfer.suns, transfer.seen)
    for kind, planes in rounded.items():
        for index, name in enumerate(entry[kind]):
            exact = [plane[:, :, index] for plane in planes]
            stored = [halves(plane) for plane in exact]
            off += sum(float(np.square(a.astype(np.float32) - b).sum(dtype=np.float64)) for a, b in zip(stored, exact, strict=True))
            power += sum(float(np.square(plane).sum(dtype=np.float64)) for plane in exact)
            _write(bundle / name, "RGBA", stored, transfer, kind, index)
    if entry["lights"]:
        entry["light"] = _names(folder, "lights")
        for index, name in enumerate(entry["light"]):
            _write(bundle / name, "RGB", [plane[:, :, index] for plane in transfer.lights], transfer, "lights", index)
    return entry | {"half_error": float(np.sqrt(off / power)) if power else 0.0}


def files_of(entry: dict | None) -> list[str]:
    """The files that the ``entry`` names (None: none)."""
    return [] if entry is None else [name for kind in ("sky", "suns", "light") for name in entry.get(kind, ())]


def read_matrices(bundle: Path, entry: dict, size: tuple[int, int]) -> AtlasTransfer:
    """The transfer of an atlas of ``size`` (height, width). Raises BakeError naming a file that is missing or damaged."""
    side, skies = entry["sun_side"], (entry["sky_order"] + 1) ** 2
    suns = len(dome.directions(side, entry["sun_below"])) if side >= LEAST_SIDE else 0
    if (suns > 0) != ("suns" in entry) or (entry["lights"] > 0) != ("light" in entry):
        raise BakeError(f"{bundle / 'atlas/atlas.json'} is damaged, its numbers of columns are not those of its images", RESTORE)

    def read(names, letters: str, kind: str, columns: int) -> np.ndarray:
        """(letters, height, width, NUMBERS, columns)."""
        rows, across = _cell(columns, side if kind == "suns" else 0)
        found = []
        for index, name in enumerate(names):
            path = require_inside(bundle, name)
            planes, header = read_exr(path, (size[0] * rows, size[1] * across))
            require_image(path, planes, letters, header, _header(entry, kind, index), "atlas.json")
            values = np.stack([planes[letter].astype(np.float32) for letter in letters])
            if not np.isfinite(values).all():
                raise BakeError(f"{path} holds values that are not finite", RESTORE)
            found.append(values.reshape(-1, size[0], rows, size[1], across).swapaxes(2, 3).reshape(-1, *size, columns))
        return np.stack(found, axis=3)

    sky = read(entry["sky"], "RGBA", "sky", skies)
    of_suns = read(entry["suns"], "RGBA", "suns", suns) if suns else np.zeros((4, *size, NUMBERS, 0), np.float32)
    count = entry["lights"]
    lights = read(entry["light"], "RGB", "lights", count) if count else np.zeros((3, *size, NUMBERS, 0), np.float32)
    return AtlasTransfer(entry["sky_order"], side if suns else 0, entry["sun_below"], sky[3], sky[:3], of_suns[:3], of_suns[3],
                         lights)


def _names(folder: str, kind: str) -> list[str]:
    return [f"{folder}/{kind}{index}.exr" for index in range(NUMBERS)]


def _cell(columns: int, side: int) -> tuple[int, int]:
    """Rows and columns of texels' matrices in an image; suns keep their grid of that ``side``."""
    return (columns // side, side) if side else (1, columns)


def _header(entry: dict, kind: str, index: int) -> dict:
    return {"kind": kind, "number": index, **{key: entry[key] for key in ("sky_order", "sun_side", "sun_below")}}


def _write(path: Path, letters: str, planes: list[np.ndarray], transfer: AtlasTransfer, kind: str, index: int) -> None:
    """``planes`` (height, width, columns) each."""
    height, width, columns = planes[0].shape
    rows, across = _cell(columns, transfer.sun_side if kind == "suns" else 0)
    if max(height * rows, width * across) > MAX_SIDE:
        raise BakeError(f"the light atlas's transfer makes an image of {width * across} x {height * rows} pixels, and {MAX_SIDE} "
                        "along a side is the most",
                        "lower its Density (--set atlas.density), or its Sun Directions (--set atlas.suns)")
    if not all(np.isfinite(plane).all() for plane in planes):
        raise BakeError("the light atlas holds values that are not finite",
                        "look for infinite light strengths in the scene, and report this with the file")
    entry = {"sky_order": transfer.sky_order, "sun_side": transfer.sun_side, "sun_below": transfer.sun_below}
    sheets = [plane.reshape(height, width, rows, across).swapaxes(1, 2).reshape(height * rows, width * across) for plane in planes]
    write_exr(path, {letter: np.ascontiguousarray(sheet) for letter, sheet in zip(letters, sheets, strict=True)},
              _header(entry, kind, index))
