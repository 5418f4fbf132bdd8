"""The files of an export's lit voxels for three.js: a .json, and a .bin of their lists one after the other, little-endian: rows in
floats, cells and light in half floats, RGBA."""

import json
from pathlib import Path

from ....storage.writing import write_file
from ...schema import RTGI_VERSION
from ..base import write_text
from ..voxels import LISTS, EngineVoxels, voxels_glsl

FORMAT = "rtgi-three-voxels/1"


def write_voxel_files(path: Path, voxels: EngineVoxels) -> None:
    """Write ``voxels`` as ``path``, a .json, and the .bin beside it. Raises OSError for a disk that refuses."""
    slices, binary = voxels.slices, path.with_suffix(".bin")
    data = b"".join(slices[name].astype("<f4" if name == "rows" else "<f2").tobytes() for name in LISTS)
    write_file(binary, data)
    grid = voxels.source.tables.grid
    description = {
        "format": FORMAT, "generator": f"RTGI {RTGI_VERSION}", "data": {"file": binary.name, "bytes": len(data)},
        "resolution": list(grid.resolution), "cell": grid.cell, "cones": voxels.source.cones,
        "cellsFromWorld": voxels.cells_from_world.T.ravel().tolist(), "cascades": voxels.cascades,
        "lists": {name: {"size": [slices[name].shape[axis] for axis in (2, 1, 0)]} for name in LISTS}, "glsl": voxels_glsl(voxels),
        "lookup": voxels.lookup}
    write_text(path, json.dumps(description, indent=1) + "\n")
