"""The files of an export's light atlas for three.js: a .json, and a .bin of half floats, RGBA: the sheet's four coefficients of
red, then of green, then of blue. Where it follows light, another .bin: sheets of a column's red, green, blue and of what is seen of
a sun, column after column (exchange/engines/atlas_transfer.py)."""

import json
from pathlib import Path

from ....storage.writing import write_file
from ...schema import RTGI_VERSION
from ..atlas import EngineAtlas, atlas_glsl
from ..atlas_transfer import EngineAtlasTransfer, relight_glsl
from ..base import write_text

FORMAT = "rtgi-three-atlas/2"
# UV maps that three.js reads of a mesh.
TEXCOORDS = 4


def write_atlas_files(path: Path, atlas: EngineAtlas, transfer: EngineAtlasTransfer | None = None) -> None:
    """Write ``atlas`` as ``path``, a .json, and the .bin beside it, ``transfer`` too. Raises OSError for a disk that refuses."""
    data, binary = atlas.slices.astype("<f2").tobytes(), path.with_suffix(".bin")
    write_file(binary, data)
    description = {"format": FORMAT, "generator": f"RTGI {RTGI_VERSION}", "data": {"file": binary.name, "bytes": len(data)},
                   "size": [atlas.size[1], atlas.size[0]], "parts": atlas.entries, "glsl": atlas_glsl()}
    if transfer is not None:
        tables, binary = transfer.slices.astype("<f2").tobytes(), path.with_name(f"{path.stem}_transfer.bin")
        write_file(binary, tables)
        description["transfer"] = {**transfer.to_json(), "data": {"file": binary.name, "bytes": len(tables)},
                                   "glsl": relight_glsl()}
    write_text(path, json.dumps(description, indent=1) + "\n")
