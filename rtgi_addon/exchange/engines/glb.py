"""Corrections to a .glb that Blender's exporter wrote."""

import json
import struct
from pathlib import Path

import numpy as np

from ...storage.writing import write_file

_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_PUNCTUAL = "KHR_lights_punctual"


def correct(path: Path, lamps: dict[str, np.ndarray], names: dict[str, str]) -> None:
    """Give the punctual lights of the .glb at ``path`` the strengths (3,) of ``lamps`` by name, and its nodes and meshes the
    ``names`` that theirs stand for; others stay.

    A strength is radiant intensity [W/sr] for points and spots, irradiance [W/m^2] for suns: what probes are baked with. Raises
    OSError.
    """
    data = path.read_bytes()
    length, _ = _CHUNK.unpack_from(data, _HEADER.size)
    start = _HEADER.size + _CHUNK.size
    content, rest = json.loads(data[start:start + length]), data[start + length:]
    for light in content.get("extensions", {}).get(_PUNCTUAL, {}).get("lights", ()):
        strength = lamps.get(light.get("name"))
        if strength is not None:
            # glTF keeps colours within 0 and 1, so the strength is that of the strongest channel.
            light["intensity"] = float(np.max(strength))
            light["color"] = (np.asarray(strength, np.float64) / max(light["intensity"], 1e-30)).tolist()
    for part in (*content.get("nodes", ()), *content.get("meshes", ())):
        part["name"] = names.get(part.get("name"), part.get("name", ""))
    text = json.dumps(content, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    magic, version, _ = _HEADER.unpack_from(data)
    header = _HEADER.pack(magic, version, start + len(text) + len(rest))
    write_file(path, header + _CHUNK.pack(len(text), b"JSON") + text + rest)
