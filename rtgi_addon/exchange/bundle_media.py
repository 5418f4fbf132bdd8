"""The media of a bundle (docs/formats.md): what fills space between surfaces, as numbers and flipbooks beside the probes.

```
OUT/media/media.json               each medium: coefficients, phase function, the box that its grid fills
OUT/media/<name>/density.exr       Y: what absorption and scattering are multiplied by, one pixel a cell
OUT/media/<name>/scattering.exr    R G B: what that coefficient is multiplied by besides; absorption and emission alike
```

The inside of a mesh is stored on a grid (`media_grids.py`). A bundle of a scene without media has none of these files.
"""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..errors import BakeError
from ..scene.medium import PHASE_KINDS, DensityGrid, Medium, Phase
from ..scene.scene import DYNAMIC
from ..storage.files import disk_error
from ..storage.parse import (
    Refused,
    affine,
    exactly,
    file_name,
    flag,
    listing,
    number,
    one_of,
    quoted,
    read_document,
    record,
    require_inside,
    text,
    whole,
)
from ..storage.writing import write_text
from . import flipbook
from .exr import read_exr, require_image, write_exr
from .media_grids import on_a_grid
from .names import folder_names
from .plain import plain
from .schema import RESTORE, SAMPLE_PLACEMENT, TILES, require_tiles

SCHEMA = "rtgi-media/1"
FOLDER = "media"
INDEX = f"{FOLDER}/media.json"
# The arrays of a grid, and the channels of their images.
ARRAYS = {"density": "Y", "scattering": "RGB", "absorption": "RGB", "emission": "RGB"}

_LARGEST = 1e30
_coefficient = listing(number(0.0, _LARGEST), 3)
_PHASE = record({"kind": one_of(*PHASE_KINDS), "anisotropy": number(-1.0, 1.0), "alpha": number(0.0, _LARGEST),
                 "ior": number(0.0, _LARGEST), "backscatter": number(0.0, 0.5), "diameter": number(0.0, _LARGEST)})
_GRID = record({"resolution": listing(whole(1, flipbook.MAX_SIDE), 3), "world_from_local": affine,
                "sample_placement": exactly(SAMPLE_PLACEMENT), "tiles": TILES, "density": file_name},
               {"scattering": file_name, "absorption": file_name, "emission": file_name})
_MEDIUM = record({"name": text, "scattering": _coefficient, "absorption": _coefficient, "emission": _coefficient, "phase": _PHASE,
                  "visible_camera": flag, "visible_diffuse": flag, "visible_shadow": flag},
                 {"grid": _GRID, "bake": exactly(DYNAMIC)})
_INDEX = record({"schema": text, "media": listing(_MEDIUM)})


def write_media(bundle, media: tuple[Medium, ...]) -> list[str]:
    """Write ``media`` into the folder ``bundle`` and return the files' names relative to it.

    Raises BakeError for a disk that refuses, values that are not finite or negative, and a grid larger than an image may be.
    """
    bundle, names, entries = Path(bundle), [], []
    for folder, medium in zip(folder_names([medium.name for medium in media], reserved=["media.json"]), media, strict=True):
        held = on_a_grid(medium)
        entry = {"name": held.name, **{kind: [float(value) for value in getattr(held, kind)]
                                       for kind in ("scattering", "absorption", "emission")},
                 "phase": plain(asdict(held.phase)),
                 **{f"visible_{kind}": bool(getattr(held, f"visible_{kind}")) for kind in ("camera", "diffuse", "shadow")}}
        if held.bake == DYNAMIC:
            entry["bake"] = DYNAMIC
        if held.grid is not None:
            entry["grid"] = _write_grid(bundle, f"{FOLDER}/{folder}", held)
            names += [entry["grid"][kind] for kind in ARRAYS if kind in entry["grid"]]
        entries.append(entry)
    try:
        write_text(bundle / INDEX, json.dumps({"schema": SCHEMA, "media": entries}, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        raise disk_error(bundle / INDEX, error) from error
    return [*names, INDEX]


def read_media(bundle, known) -> tuple[Medium, ...]:
    """The media whose files lie in the folder ``bundle``, of which all are among the ``known`` ones, by name, that have checksums.
    Raises BakeError naming a file that is missing, damaged or has none."""
    bundle = Path(bundle)
    index = read_document(bundle / INDEX, SCHEMA, _check_index, RESTORE)
    unknown = next((name for entry in index["media"] for kind in ARRAYS
                    if (name := entry.get("grid", {}).get(kind)) is not None and name not in known), None)
    if unknown is not None:
        raise BakeError(f"{bundle / INDEX} names {unknown}, which has no checksum", RESTORE)
    return tuple(_read_medium(bundle, entry) for entry in index["media"])


def _write_grid(bundle: Path, folder: str, medium: Medium) -> dict:
    grid, tiles = medium.grid, flipbook.layout(medium.grid.resolution)
    entry = {"resolution": [int(count) for count in grid.resolution],
             "world_from_local": np.asarray(grid.world_from_local, np.float64).tolist(), "sample_placement": SAMPLE_PLACEMENT,
             "tiles": tiles._asdict(), **{kind: f"{folder}/{kind}.exr" for kind in ARRAYS if getattr(grid, kind) is not None}}
    try:
        (bundle / folder).mkdir(parents=True, exist_ok=True)
        for kind, letters in ARRAYS.items():
            if kind not in entry:
                continue
            values = np.asarray(getattr(grid, kind), np.float32).reshape(*grid.density.shape, len(letters))
            if not np.isfinite(values).all() or np.any(values < 0):
                raise BakeError(f"medium {medium.name!r}: its {kind} is negative or not finite",
                                "correct the volume's grid or its material")
            sheet = flipbook.to_sheet(values, tiles)
            write_exr(bundle / entry[kind], {letter: sheet[..., channel] for channel, letter in enumerate(letters)},
                      _image_header(medium.name, entry, kind))
    except OSError as error:
        raise disk_error(bundle / folder, error) from error
    return entry


def _read_medium(bundle: Path, entry: dict) -> Medium:
    grid = None
    if "grid" in entry:
        found = entry["grid"]
        arrays = {kind: _read_array(bundle, entry["name"], found, kind) for kind in ARRAYS if kind in found}
        arrays["density"] = arrays["density"][..., 0]
        grid = DensityGrid(np.array(found["world_from_local"], np.float64), **arrays)
    return Medium(entry["name"], *(np.array(entry[kind], np.float64) for kind in ("scattering", "absorption", "emission")),
                  phase=Phase(**entry["phase"]), grid=grid, **{key: entry[key] for key in entry if key.startswith("visible_")},
                  **({"bake": entry["bake"]} if "bake" in entry else {}))


def _read_array(bundle: Path, name: str, entry: dict, kind: str) -> np.ndarray:
    path, tiles, resolution = require_inside(bundle, entry[kind]), flipbook.Tiles(**entry["tiles"]), entry["resolution"]
    planes, header = read_exr(path, (tiles.rows * resolution[1], tiles.columns * resolution[0]))
    require_image(path, planes, ARRAYS[kind], header, _image_header(name, entry, kind), INDEX)
    sheet = np.stack([planes[letter] for letter in ARRAYS[kind]], axis=-1, dtype=np.float32)
    if not np.isfinite(sheet).all() or np.any(sheet < 0):
        raise BakeError(f"{path} holds values that are negative or not finite", RESTORE)
    return flipbook.from_sheet(sheet, resolution, tiles)


def _image_header(name: str, entry: dict, kind: str) -> dict:
    """What the image of a grid's array repeats of its entry."""
    return {"schema": SCHEMA, "medium": name, "kind": kind,
            **{key: entry[key] for key in ("resolution", "world_from_local", "sample_placement", "tiles")}}


def _check_index(index: dict, where: str) -> None:
    _INDEX(index, where)
    for number_, entry in enumerate(index["media"]):
        if "grid" in entry:
            require_tiles(entry["grid"]["tiles"], entry["grid"]["resolution"], f"media[{number_}].grid.tiles")
    named = [entry["grid"][kind] for entry in index["media"] if "grid" in entry for kind in ARRAYS if kind in entry["grid"]]
    repeated = next((name for place, name in enumerate(named) if name.lower() in {other.lower() for other in named[:place]}), None)
    if repeated is not None:
        raise Refused(f"file {quoted(repeated)} is named twice")
