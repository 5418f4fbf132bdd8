"""The files of an export's media for three.js: a .json, a .bin of half floats, and the shader as a module.

The .bin, little-endian, holds the ambient light first, seven blocks of nz slices of RGBA (media.glsl), then the cells of each box:
one half a cell where there is one block, four where there are three.
"""

import json
from pathlib import Path

from ....storage.writing import write_file
from ...schema import RTGI_VERSION
from ..base import write_text
from ..media import EngineMedia
from ..media_shader import media_shader
from ..media_textures import ambient_blocks, cell_blocks

FORMAT = "rtgi-three-media/1"
# WebGL has no precision of its own for such samplers.
_AHEAD = "precision highp float;\nprecision highp sampler3D;\n"


def write_media_files(path: Path, media: EngineMedia) -> None:
    """Write ``media`` as ``path``, a .json, and the .bin beside it. Raises OSError for a disk that refuses."""
    arrays = [ambient_blocks(media), *(cell_blocks(box) for box in media.boxes)]
    data = b"".join(values.astype("<f2").tobytes() for values in arrays)
    binary = path.with_suffix(".bin")
    write_file(binary, data)
    nz, ny, nx = media.ambient.shape[:3]
    description = {
        "format": FORMAT, "generator": f"RTGI {RTGI_VERSION}", "data": {"file": binary.name, "bytes": len(data)},
        "everywhere": media.fills_space, "extinction": media.extinction.tolist(), "emission": media.emission.tolist(),
        "scattering": media.scattering.ravel().tolist(),
        "ambient": {"resolution": [nx, ny, nz], "unitFromWorld": media.ambient_from_world.T.ravel().tolist()},
        "boxes": [{"name": box.name, "resolution": list(box.resolution), "blocks": len(box.cells),
                   "unitFromWorld": box.unit_from_world.T.ravel().tolist(), "scattering": box.scattering.tolist(),
                   "absorption": box.absorption.tolist(), "emission": box.emission.tolist(), "moments": box.moments.tolist()}
                  for box in media.boxes],
        "glsl": media_shader(media, ahead=_AHEAD),
    }
    write_text(path, json.dumps(description, indent=1) + "\n")
