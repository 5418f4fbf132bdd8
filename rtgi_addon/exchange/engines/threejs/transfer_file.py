"""The files of an export's transfer for three.js: a .json, a .bin with the tables, and the shader as a module.

The .bin, little-endian, holds column after column, of each all probes in the order of probes.bin, of each 28 halves
(exchange/engines/transfer.py).
"""

import json
from pathlib import Path

import numpy as np

from ....storage.writing import write_file
from ...schema import RTGI_VERSION
from ..base import write_text
from ..glsl import relight_glsl, shared_glsl
from ..transfer import EngineTransfer

FORMAT = "rtgi-three-transfer/2"


def write_transfer_files(path: Path, transfer: EngineTransfer) -> None:
    """Write ``transfer`` as ``path``, a .json, and the .bin beside it. Raises OSError for a disk that refuses."""
    data = np.concatenate(transfer.tables, axis=1).astype("<f2").tobytes()
    binary = path.with_suffix(".bin")
    write_file(binary, data)
    description = {"format": FORMAT, "generator": f"RTGI {RTGI_VERSION}", "data": {"file": binary.name, "bytes": len(data)},
                   "probes": int(sum(table.shape[1] for table in transfer.tables)), **transfer.to_json()}
    write_text(path, json.dumps(description, indent=1) + "\n")


def relight_module() -> str:
    """An ES module whose `relit` is what a shader needs before and after its samplers: numbers and functions."""
    return (f"// Written by the export.\nexport const numbers = {json.dumps(shared_glsl())};\n"
            f"export const relit = {json.dumps(relight_glsl())};\n")
