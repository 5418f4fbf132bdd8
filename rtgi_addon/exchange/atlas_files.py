"""The light atlas of a bundle (docs/formats.md): light at the texels of objects' UV maps, and where each object's map lies.

```
OUT/atlas/atlas.json          of each object its UV map and its rectangle
OUT/atlas/sh0.exr … sh3.exr   R G B, float: SH of order 1 of the radiance that arrives
OUT/atlas/irradiance.exr      R G B, float: irradiance under the texels' own normals
OUT/atlas/known.exr           Y: 1 where rays left from, 0 where a texel was filled in from those about it
OUT/atlas/lightmap.png        the same irradiance in 8 bits, sRGB, of which 1 stands for `white`: for readers of pictures alone
OUT/atlas/transfer/…          what texels make of any light (atlas_transfer.py); only beside the technique `transfer`
```

A bundle of a scene without an atlas has none of these files.
"""

import json
from pathlib import Path

import numpy as np

from ..effects.atlas.coefficients import COUNT
from ..effects.atlas.sheet import LightAtlas
from ..effects.atlas.unwrapped import Part, Sheet
from ..errors import BakeError
from ..numerics.colour import srgb_from_linear
from ..storage.files import disk_error
from ..storage.parse import Refused, exactly, file_name, listing, number, quoted, read_document, record, require_inside, text, whole
from ..storage.png import write_png
from ..storage.writing import write_text
from .atlas_transfer import TRANSFER, files_of, read_matrices, write_matrices
from .exr import read_exr, require_image, write_exr
from .flipbook import MAX_SIDE
from .schema import RESTORE, SH_CONVENTION

SCHEMA = "rtgi-atlas/1"
FOLDER = "atlas"
INDEX = f"{FOLDER}/atlas.json"
_SPACE = "st = (u, 1 - v); texels = st * scale + offset, row 0 on top"
# Light beyond this share of all texels is cut in the 8-bit image.
_WHITE = 0.999

_SIDE = whole(1, MAX_SIDE)
_PART = record({"name": text, "uv_map": text, "texcoord": whole(0, 63), "x": whole(0, MAX_SIDE), "y": whole(0, MAX_SIDE),
                "width": _SIDE, "height": _SIDE, "scale": number(0.0), "offset": listing(number(), 2)})
_INDEX = record({"schema": text, "sh_convention": exactly(SH_CONVENTION), "space": exactly(_SPACE), "width": _SIDE, "height": _SIDE,
                 "sh": listing(file_name, COUNT), "irradiance": file_name, "known": file_name, "image": file_name,
                 "white": number(0.0), "parts": listing(_PART)}, {"transfer": TRANSFER})


def write_atlas(bundle, atlas: LightAtlas) -> list[str]:
    """Write ``atlas`` into the folder ``bundle`` and return the files' names relative to it. Raises BakeError for a disk that
    refuses, and for values that are not finite."""
    bundle = Path(bundle)
    if not (np.isfinite(atlas.coefficients).all() and np.isfinite(atlas.irradiance).all()):
        raise BakeError("the light atlas holds values that are not finite",
                        "look for infinite light strengths in the scene, and report this with the file")
    light = atlas.irradiance[atlas.known]
    white = float(np.quantile(light.max(axis=1), _WHITE)) if len(light) else 0.0
    height, width = atlas.sheet.size
    index = {
        "schema": SCHEMA, "sh_convention": SH_CONVENTION, "space": _SPACE, "width": width, "height": height,
        "sh": [f"{FOLDER}/sh{number}.exr" for number in range(COUNT)], "irradiance": f"{FOLDER}/irradiance.exr",
        "known": f"{FOLDER}/known.exr", "image": f"{FOLDER}/lightmap.png", "white": white or 1.0,
        "parts": [{"name": part.name, "uv_map": part.uv_map, "texcoord": part.texcoord, "x": part.x, "y": part.y,
                   "width": part.width, "height": part.height, "scale": part.scale, "offset": part.offset.tolist()}
                  for part in atlas.sheet.parts]}
    try:
        (bundle / FOLDER).mkdir(parents=True, exist_ok=True)
        if atlas.transfer is not None:
            index["transfer"] = write_matrices(bundle, f"{FOLDER}/transfer", atlas.transfer)
        for number_, name in enumerate(index["sh"]):
            _write(bundle / name, "RGB", atlas.coefficients[:, :, number_], _header(index, "sh", number_))
        _write(bundle / index["irradiance"], "RGB", atlas.irradiance, _header(index, "irradiance"))
        _write(bundle / index["known"], "Y", atlas.known[..., None].astype(np.float16), _header(index, "known"))
        write_png(bundle / index["image"], np.rint(255.0 * srgb_from_linear(np.clip(atlas.irradiance / index["white"], 0.0, 1.0))))
        write_text(bundle / INDEX, json.dumps(index, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        raise disk_error(bundle / FOLDER, error) from error
    return [*_files(index), INDEX]


def read_atlas(bundle, known) -> LightAtlas:
    """The light atlas whose files lie in the folder ``bundle``, of which all are among the ``known`` ones, by name, that have
    checksums. Raises BakeError naming a file that is missing, damaged or has none."""
    bundle = Path(bundle)
    index = read_index(bundle)
    unknown = next((name for name in _files(index) if name not in known), None)
    if unknown is not None:
        raise BakeError(f"{bundle / INDEX} names {unknown}, which has no checksum", RESTORE)
    size = index["height"], index["width"]

    def read(name: str, letters: str, kind: str, coefficient: int | None = None) -> np.ndarray:
        path = require_inside(bundle, name)
        planes, header = read_exr(path, size)
        require_image(path, planes, letters, header, _header(index, kind, coefficient), INDEX)
        values = np.stack([planes[letter] for letter in letters], axis=-1).astype(np.float32)
        if not np.isfinite(values).all():
            raise BakeError(f"{path} holds values that are not finite", RESTORE)
        return values

    parts = tuple(Part(entry["name"], -1, entry["uv_map"], entry["texcoord"], entry["x"], entry["y"], entry["width"],
                       entry["height"], entry["scale"], np.array(entry["offset"])) for entry in index["parts"])
    coefficients = np.stack([read(name, "RGB", "sh", number_) for number_, name in enumerate(index["sh"])], axis=2)
    transfer = read_matrices(bundle, index["transfer"], size) if "transfer" in index else None
    return LightAtlas(Sheet(parts, size), coefficients, read(index["irradiance"], "RGB", "irradiance"),
                      read(index["known"], "Y", "known")[..., 0] > 0.5, transfer)


def read_index(bundle) -> dict:
    """The checked atlas.json of the bundle's folder. Raises BakeError naming what is missing or damaged."""
    return read_document(Path(bundle) / INDEX, SCHEMA, _check_index, RESTORE)


def _write(path: Path, letters: str, values: np.ndarray, header: dict) -> None:
    write_exr(path, {letter: np.ascontiguousarray(values[..., c]) for c, letter in enumerate(letters)}, header)


def _files(index: dict) -> list[str]:
    return [*index["sh"], index["irradiance"], index["known"], index["image"], *files_of(index.get("transfer"))]


def _header(index: dict, kind: str, coefficient: int | None = None) -> dict:
    """What an image repeats of the index, so that it can be read alone."""
    header = {key: index[key] for key in ("schema", "sh_convention", "space", "width", "height", "parts")} | {"kind": kind}
    return header if coefficient is None else header | {"coefficient": coefficient}


def _check_index(index: dict, where: str) -> None:
    _INDEX(index, where)
    if not index["parts"]:
        raise Refused("it has no parts")
    names = [name.lower() for name in _files(index)]
    repeated = next((name for place, name in enumerate(names) if name in names[:place]), None)
    if repeated is not None:
        raise Refused(f"file {quoted(repeated)} is named twice")
    for part in index["parts"]:
        if part["x"] + part["width"] > index["width"] or part["y"] + part["height"] > index["height"]:
            raise Refused(f"part {quoted(part['name'])} is not within {index['width']} × {index['height']} texels")
