"""The two files of probes that the loader reads: a .json that describes the volumes and a .bin with their numbers.

The .bin, little-endian, holds all probes first: nine texels of four halves each, the radiance coefficients (r, g, b), and in the
fourth channel of the first four texels the probe's offset from its lattice point and whether it holds light. Then come the tiles of
all probes: two unsigned 16-bit numbers a texel, mean and standard deviation of the distance in the volume's own steps. Halves would
lose what the share that a probe sees lives on: at a mean of 4 m they are 4 mm apart, and the mean of squares less the square of the
mean is the difference of two large numbers. Distances are bounded, so fixed point holds both to some hundredths of a millimetre.

Last, in floats, come the words of the nodes of scattered volumes, four each (scene/scattered.py): their `resolution` is that of the
nodes, `probes` how long their list is, and offsets are from the volume's centre.
"""

import json
from pathlib import Path

import numpy as np

from ....storage.writing import write_file
from ...schema import RTGI_VERSION
from ..base import write_text
from ..volumes import ExportVolume, to_half

FORMAT = "rtgi-three/1"
_STEPS = 65535.0


def write_probes(path: Path, volumes: tuple[ExportVolume, ...], scene: str, manifest: dict) -> None:
    """Write ``volumes`` of the bake with this ``manifest`` as ``path``, a .json, and the .bin beside it.

    Raises BakeError for light beyond what halves hold, OSError for a disk that refuses.
    """
    tiles = [_tiles(volume) for volume in volumes]
    words = [volume.words.astype("<f4").tobytes() for volume in volumes if volume.words is not None]
    data = b"".join([*(_probes(volume).tobytes() for volume in volumes), *(stored.tobytes() for stored, _ in tiles), *words])
    binary = path.with_suffix(".bin")
    write_file(binary, data)
    description = {
        "format": FORMAT,
        "generator": f"RTGI {RTGI_VERSION}",
        "scene": scene,
        "includesDirect": bool(manifest.get("includes_direct")),
        "lamps": manifest.get("lamps", {}),
        "objects": manifest.get("objects", {}),
        "data": {"file": binary.name, "bytes": len(data)},
        "volumes": [_entry(volume, step) for volume, (_, step) in zip(volumes, tiles, strict=True)],
    }
    write_text(path, json.dumps(description, indent=1) + "\n")


def _entry(volume: ExportVolume, distance_step: float) -> dict:
    """A volume as the loader reads it; matrices column by column, as ``Matrix4.fromArray`` takes them."""
    scattered = {} if volume.words is None else {"probes": int(volume.live.size)}
    return {"name": volume.name, "resolution": [int(count) for count in volume.nodes], **scattered,
            "centre": volume.centre.tolist(),
            "worldFromLocal": volume.world_from_local.T.ravel().tolist(),
            "latticeFromOffset": volume.lattice_from_offset.T.ravel().tolist(),
            "normalBias": volume.bias, "tile": volume.tile, "distanceStep": distance_step}


def _probes(volume: ExportVolume) -> np.ndarray:
    """(p, 9, 4) little-endian float16."""
    coefficients = volume.sh.reshape(-1, *volume.sh.shape[3:])
    texels = np.zeros((*coefficients.shape[:2], 4), np.float32)
    texels[..., :3] = coefficients
    texels[:, :3, 3] = volume.offset.reshape(-1, 3)
    texels[:, 3, 3] = volume.live.ravel()
    return to_half(texels, f"volume {volume.name}").astype("<f2")


def _tiles(volume: ExportVolume) -> tuple[np.ndarray, float]:
    """(p, T, T, 2) little-endian uint16 of mean and deviation, and how far one step of them is."""
    moments = volume.moments[..., 1:-1, 1:-1, :].astype(np.float64)
    mean = moments[..., 0]
    distances = np.stack([mean, np.sqrt(np.maximum(moments[..., 1] - mean * mean, 0.0))], axis=-1)
    step = max(float(distances.max()), np.finfo(np.float32).tiny) / _STEPS
    return np.rint(distances / step).astype("<u2"), step
