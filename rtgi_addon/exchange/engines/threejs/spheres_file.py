"""The files of an export's sphere probes for three.js: a .json, and a .bin of half floats, RGBA, of each probe the stack of its
levels."""

import json
from pathlib import Path

from ....storage.writing import write_file
from ...schema import RTGI_VERSION
from ..base import write_text
from ..spheres import EngineSpheres, spheres_glsl

FORMAT = "rtgi-three-spheres/1"


def write_sphere_files(path: Path, spheres: EngineSpheres) -> None:
    """Write ``spheres`` as ``path``, a .json, and the .bin beside it. Raises OSError for a disk that refuses."""
    slices = spheres.slices
    data, binary = slices.astype("<f2").tobytes(), path.with_suffix(".bin")
    write_file(binary, data)
    description = {
        "format": FORMAT, "generator": f"RTGI {RTGI_VERSION}", "data": {"file": binary.name, "bytes": len(data)},
        "names": [item.probe.name for item in spheres.probes.maps], "size": [slices.shape[2], slices.shape[1]], **spheres.sizes,
        "table": [float(f"{value:.9g}") for value in spheres.table.ravel()], "glsl": spheres_glsl(spheres)}
    write_text(path, json.dumps(description, indent=1) + "\n")
