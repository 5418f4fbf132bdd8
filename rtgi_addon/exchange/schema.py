"""The words of `bake.json` (FORMATS.md), shared by everything that writes or reads a bundle."""

import json
import math
from pathlib import Path, PurePosixPath

from ..errors import BakeError
from .files import disk_error

SCHEMA = "rtgi-bundle/1"
SH_CONVENTION = "real-orthonormal, no Condon-Shortley, radiance, Z-up"
SAMPLE_PLACEMENT = "cell-centred"
RTGI_VERSION = "0.1.0"
MANIFEST = "bake.json"

RESTORE = "bake again or restore the bundle"

_TOP = {"schema": str, "scene": str, "blender": str, "rtgi": str, "technique": str, "settings": dict, "seed": int,
        "sh_convention": str, "volumes": list, "stats": dict, "sha256": dict}
_VOLUME = {"name": str, "resolution": list, "world_from_local": list, "sample_placement": str, "sh_order": int, "tiles": dict,
           "sh": list, "visibility": str, "visibility_tiles": dict, "visibility_size": int, "validity": str}


def read_manifest(folder) -> dict:
    """The checked contents of ``folder``/bake.json: every key there with its type, every file listed inside the folder.

    Raises BakeError naming the file and what is wrong with it.
    """
    path = Path(folder) / MANIFEST
    if not Path(folder).is_dir():
        raise BakeError(f"there is no bundle at {folder}", "give the folder that `bake --out` wrote")
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise BakeError(f"{folder} is not a bundle, it has no {MANIFEST}", "give the folder that `bake --out` wrote") from None
    except UnicodeDecodeError:
        raise BakeError(f"{path} is damaged", RESTORE) from None
    except OSError as error:
        raise disk_error(path, error, doing="read") from error
    try:
        manifest = json.loads(text)
    except ValueError:
        raise BakeError(f"{path} is damaged, it is not JSON", RESTORE) from None
    schema = manifest.get("schema") if isinstance(manifest, dict) else None
    if schema != SCHEMA:
        raise BakeError(f"{path} has schema {schema!r} instead of {SCHEMA!r}", "bake again, or use the rtgi that wrote it")
    problem = _problem(manifest)
    if problem:
        raise BakeError(f"{path} is damaged, {problem}", RESTORE)
    return manifest


def _problem(manifest: dict) -> str | None:
    """The first thing that keeps ``manifest`` from being read, or None."""
    missing = _missing(manifest, _TOP)
    if missing:
        return missing
    if manifest["sh_convention"] != SH_CONVENTION:
        return f"its SH convention is {manifest['sh_convention']!r}"
    for volume in manifest["volumes"]:
        missing = _missing(volume, _VOLUME) if isinstance(volume, dict) else "a volume is not an object"
        if missing:
            return missing
        problem = _volume_problem(volume, manifest["sha256"])
        if problem:
            return f"volume {volume['name']!r}: {problem}"
    return None


def _missing(values: dict, wanted: dict[str, type]) -> str | None:
    for key, kind in wanted.items():
        if not isinstance(values.get(key), kind):
            return f"{key!r} is missing or of the wrong type"
    return None


def _volume_problem(volume: dict, digests: dict) -> str | None:
    resolution, matrix = volume["resolution"], volume["world_from_local"]
    if len(resolution) != 3 or not all(isinstance(n, int) and n > 0 for n in resolution):
        return "its resolution is not three positive numbers"
    if len(matrix) != 4 or not all(isinstance(row, list) and len(row) == 4 for row in matrix):
        return "its matrix is not 4×4"
    if not all(isinstance(value, (int, float)) and math.isfinite(value) for row in matrix for value in row):
        return "its matrix is not finite"
    if volume["sample_placement"] != SAMPLE_PLACEMENT:
        return f"its sample placement is {volume['sample_placement']!r}"
    if volume["sh_order"] < 0 or len(volume["sh"]) != (volume["sh_order"] + 1) ** 2:
        return f"{len(volume['sh'])} SH files do not make order {volume['sh_order']}"
    for key in ("tiles", "visibility_tiles"):
        if not all(isinstance(volume[key].get(side), int) and volume[key][side] > 0 for side in ("columns", "rows")):
            return f"its {key} are not columns and rows"
        if volume[key]["columns"] * volume[key]["rows"] < resolution[2]:
            return f"its {key} are too few for {resolution[2]} slices"
    if volume["visibility_size"] < 1:
        return "its visibility maps have no size"
    for name in files_of(volume):
        if not isinstance(name, str) or not _is_inside(name):
            return f"file {name!r} lies outside the bundle"
        if not isinstance(digests.get(name), str):
            return f"file {name!r} has no checksum"
    return None


def files_of(volume: dict) -> list[str]:
    """Every file a volume's entry names, relative to the bundle."""
    optional = [volume[key] for key in ("offset", "standard_error") if key in volume]
    return [*volume["sh"], volume["visibility"], volume["validity"], *optional]


def _is_inside(name: str) -> bool:
    path = PurePosixPath(name)
    return not path.is_absolute() and ".." not in path.parts and "\\" not in name and ":" not in name
