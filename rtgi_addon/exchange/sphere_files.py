"""The sphere probes of a bundle (docs/formats.md): radiance at Light Probe Spheres, and where each of them stands for it.

```
OUT/spheres/spheres.json        of each probe its place, influence and parallax, and the levels of its map
OUT/spheres/<name>.exr          R G B, half: the levels one below the other, octahedral, row 0 of each on top
```

A bundle of a scene without sphere probes has none of these files.
"""

import json
from pathlib import Path

import numpy as np

from ..effects.spheres.maps import SphereMap, SphereProbes, level_alpha, level_sides
from ..effects.spheres.settings import RESOLUTIONS
from ..errors import BakeError
from ..scene.sphere_probe import BOX, MOST_SPHERES, SPHERE, SphereProbe
from ..storage.files import disk_error
from ..storage.parse import (
    Refused,
    affine,
    exactly,
    file_name,
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
from .exr import read_exr, require_image, write_exr
from .names import folder_names
from .schema import RESTORE

SCHEMA = "rtgi-spheres/1"
FOLDER = "spheres"
INDEX = f"{FOLDER}/spheres.json"

_LARGEST = 1e30
_VOLUME = record({"shape": one_of(SPHERE, BOX), "distance": number(0.0, _LARGEST)})
_LEVEL = record({"side": whole(1, 4096), "alpha": number(0.0, 1.0)})
_PROBE = record({"name": text, "world_from_local": affine, "influence": _VOLUME, "falloff": number(0.0, _LARGEST),
                 "parallax": _VOLUME, "clip": listing(number(0.0, _LARGEST), 2), "map": file_name})
_INDEX = record({"schema": text, "map": exactly("octahedral, radiance, Z-up"), "light": text, "resolution": whole(1, 4096),
                 "levels": listing(_LEVEL), "probes": listing(_PROBE)})


def write_spheres(bundle, spheres: SphereProbes) -> list[str]:
    """Write ``spheres`` into the folder ``bundle`` and return the files' names relative to it. Raises BakeError for a disk that
    refuses, and for values that are negative or not finite."""
    bundle, entries, resolution = Path(bundle), [], spheres.resolution
    try:
        (bundle / FOLDER).mkdir(parents=True, exist_ok=True)
        names = folder_names([item.probe.name for item in spheres.maps], reserved=["spheres.json"])
        for name, item in zip(names, spheres.maps, strict=True):
            probe = item.probe
            sheet = _sheet(item.levels)
            if not np.isfinite(sheet).all() or np.any(sheet < 0):
                raise BakeError(f"sphere probe {probe.name!r}: its radiance is negative or not finite",
                                "look for infinite light strengths in the scene, and report this with the file")
            entry = {"name": probe.name, "world_from_local": np.asarray(probe.world_from_local, np.float64).tolist(),
                     "influence": {"shape": probe.influence_shape, "distance": probe.influence_distance},
                     "falloff": probe.falloff, "parallax": {"shape": probe.parallax_shape, "distance": probe.parallax_distance},
                     "clip": [probe.clip_start, min(probe.clip_end, _LARGEST)], "map": f"{FOLDER}/{name}.exr"}
            write_exr(bundle / entry["map"], {letter: sheet[..., c] for c, letter in enumerate("RGB")},
                      _image_header(entry, resolution))
            entries.append(entry)
        index = {"schema": SCHEMA, "map": "octahedral, radiance, Z-up", "light": spheres.light, "resolution": resolution,
                 "levels": _levels(resolution), "probes": entries}
        write_text(bundle / INDEX, json.dumps(index, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        raise disk_error(bundle / FOLDER, error) from error
    return [*(entry["map"] for entry in entries), INDEX]


def read_spheres(bundle, known) -> SphereProbes:
    """The sphere probes whose files lie in the folder ``bundle``, of which all are among the ``known`` ones, by name, that have
    checksums. Raises BakeError naming a file that is missing, damaged or has none."""
    bundle = Path(bundle)
    index = read_index(bundle)
    unknown = next((entry["map"] for entry in index["probes"] if entry["map"] not in known), None)
    if unknown is not None:
        raise BakeError(f"{bundle / INDEX} names {unknown}, which has no checksum", RESTORE)
    return SphereProbes([_read_map(bundle, entry, index["resolution"]) for entry in index["probes"]], index["light"])


def read_index(bundle) -> dict:
    """The checked spheres.json of the bundle's folder. Raises BakeError naming what is missing or damaged."""
    return read_document(Path(bundle) / INDEX, SCHEMA, _check_index, RESTORE)


def _read_map(bundle: Path, entry: dict, resolution: int) -> SphereMap:
    path, sides = require_inside(bundle, entry["map"]), level_sides(resolution)
    planes, header = read_exr(path, (sum(sides), resolution))
    require_image(path, planes, "RGB", header, _image_header(entry, resolution), INDEX)
    sheet = np.stack([planes[letter] for letter in "RGB"], axis=-1)
    if sheet.dtype != np.float16 or not np.isfinite(sheet).all() or np.any(sheet < 0):
        raise BakeError(f"{path} holds values that are negative, not finite or no half floats", RESTORE)
    first = np.cumsum([0, *sides])
    return SphereMap(_probe(entry), tuple(np.ascontiguousarray(sheet[row:row + side, :side])
                                          for row, side in zip(first[:-1], sides, strict=True)))


def _probe(entry: dict) -> SphereProbe:
    influence, parallax = entry["influence"], entry["parallax"]
    return SphereProbe(entry["name"], np.array(entry["world_from_local"], np.float64), influence["shape"], influence["distance"],
                       entry["falloff"], parallax["shape"], parallax["distance"], *entry["clip"])


def _sheet(levels: tuple[np.ndarray, ...]) -> np.ndarray:
    resolution = len(levels[0])
    sheet = np.zeros((sum(len(level) for level in levels), resolution, 3), np.float16)
    row = 0
    for level in levels:
        sheet[row:row + len(level), :len(level)] = level
        row += len(level)
    return sheet


def _levels(resolution: int) -> list[dict]:
    return [{"side": side, "alpha": level_alpha(resolution, level) if level else 0.0}
            for level, side in enumerate(level_sides(resolution))]


def _image_header(entry: dict, resolution: int) -> dict:
    """What the image of a probe repeats of its entry, so that it can be read alone."""
    return {"schema": SCHEMA, "resolution": resolution, "levels": _levels(resolution),
            **{key: entry[key] for key in ("name", "world_from_local", "influence", "falloff", "parallax", "clip")}}


def _check_index(index: dict, where: str) -> None:
    _INDEX(index, where)
    resolution = index["resolution"]
    if str(resolution) not in RESOLUTIONS:
        raise Refused(f"resolution {resolution} is none of {', '.join(RESOLUTIONS)}")
    if index["levels"] != _levels(resolution):
        raise Refused(f"levels are not those of maps of {resolution} texels")
    if not 1 <= len(index["probes"]) <= MOST_SPHERES:
        raise Refused(f"it has {len(index['probes'])} probes, and not 1 to {MOST_SPHERES}")
    named = [entry["map"].lower() for entry in index["probes"]]
    repeated = next((name for place, name in enumerate(named) if name in named[:place]), None)
    if repeated is not None:
        raise Refused(f"file {quoted(repeated)} is named twice")
    for entry in index["probes"]:
        if not _probe(entry).is_regular:
            raise Refused(f"sphere probe {quoted(entry['name'])} has no volume")
