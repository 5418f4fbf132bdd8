"""What `bake.json` says and how (docs/formats.md), shared by everything that writes or reads a bundle."""

import hashlib
import json
import math
from pathlib import Path

from ..errors import BakeError
from ..scene.scattered import SLOTS
from ..storage.parse import (
    MAX_BYTES,
    Refused,
    affine,
    anything,
    digest,
    exactly,
    file_name,
    flag,
    listing,
    number,
    one_of,
    or_nothing,
    parse_document,
    quoted,
    record,
    table,
    text,
    whole,
)
from ..storage.reading import read_file
from .flipbook import MAX_SIDE

SCHEMA = "rtgi-bundle/1"
SH_CONVENTION = "real-orthonormal, no Condon-Shortley, radiance, Z-up"
SAMPLE_PLACEMENT = "cell-centred"
# What a volume's SH and distances are: measured at its probes, or fitted to how they are read. Where nothing is said: measured.
MEASURED, FITTED = "measured", "fitted"
RTGI_VERSION = "0.1.0"
MANIFEST = "bake.json"
# Beside the folders of bundles that are a series (exchange/series.py).
SERIES = "series.json"

RESTORE = "restore the bundle, or remove it and bake again"
NO_CHECKSUM = "bake.json has no checksum of itself, as before there was one: a change in it would not be noticed"

# The highest order a technique bakes (techniques/probes/settings.py).
MAX_ORDER = 8
# Where in `stats` the checksum of bake.json itself stands.
CHECKSUM = "checksum"
_UNSEALED = "0" * 64

TILES = record({"columns": whole(1, MAX_SIDE), "rows": whole(1, MAX_SIDE)})
_VOLUME = record(
    {"name": text, "resolution": listing(whole(1, MAX_SIDE), 3), "world_from_local": affine,
     "sample_placement": exactly(SAMPLE_PLACEMENT), "sh_order": whole(0, MAX_ORDER), "tiles": TILES, "sh": listing(file_name),
     "visibility": file_name, "visibility_tiles": TILES, "visibility_size": whole(1, MAX_SIDE), "validity": file_name},
    {"fitted": flag, "coefficients": one_of(MEASURED, FITTED), "offset": file_name, "standard_error": file_name,
     "index": record({"file": file_name, "resolution": listing(whole(1, MAX_SIDE), 3), "tiles": TILES})})
_OMISSION = record({"text": text, "objects": listing(text), "materials": listing(text), "share": or_nothing(number()), "how": text})
_MANIFEST = record(
    {"schema": text, "scene": text, "blender": text, "rtgi": text, "technique": text, "settings": table(text, anything),
     "seed": whole(), "sh_convention": exactly(SH_CONVENTION), "volumes": listing(_VOLUME), "stats": table(text, anything),
     "sha256": table(file_name, digest)},
    {"includes_direct": flag, "lamps": table(text, one_of("all", "bounces", "none")), "objects": table(text, one_of("dynamic")),
     "lpv": file_name, "media": exactly("media/media.json"), "transfer": file_name,
     "spheres": exactly("spheres/spheres.json"), "atlas": exactly("atlas/atlas.json"),
     "voxels": exactly("voxels/voxels.json"), "notes": listing(text),
     "not_followed": listing(_OMISSION),
     "bytes": table(file_name, whole(0))})


def read_manifest(folder) -> dict:
    """The checked contents of ``folder``/bake.json: nothing missing, unknown, out of range or changed since it was written.

    Raises BakeError naming the file and what is wrong with it.
    """
    path = Path(folder) / MANIFEST
    if not Path(folder).is_dir():
        raise BakeError(f"there is no bundle at {folder}", "give the folder that `bake --out` wrote")
    try:
        data = read_file(path, MAX_BYTES)
    except BakeError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            if (Path(folder) / SERIES).is_file():
                raise BakeError(f"{folder} is a series of bundles, and one is wanted",
                                "give the folder of one of its frames") from None
            raise BakeError(f"{folder} is not a bundle, it has no {MANIFEST}", "give the folder that `bake --out` wrote") from None
        raise
    return parse_manifest(data, path)


def parse_manifest(data: bytes, path) -> dict:
    """As ``read_manifest``, of the bytes of the file at ``path``."""
    manifest = parse_document(data, path, SCHEMA, _check_manifest, RESTORE)
    stated = manifest["stats"].get(CHECKSUM)
    if stated is not None and stated != _own_digest(data, stated):
        raise BakeError(f"{path} is damaged, it is not as it was written: its checksum is another", RESTORE)
    return manifest


def manifest_bytes(manifest: dict) -> bytes:
    """``manifest`` as the bytes of bake.json, with a checksum of these very bytes among its statistics: what differs from run to
    run stays in there."""
    stats = {**manifest["stats"], CHECKSUM: _UNSEALED}
    unsealed = (json.dumps({**manifest, "stats": stats}, indent=1, allow_nan=False) + "\n").encode()
    return unsealed.replace(_seal(_UNSEALED), _seal(_own_digest(unsealed, _UNSEALED)))


def _own_digest(data: bytes, stated: str) -> str:
    """SHA-256 of bake.json with zeros for the digits of its own checksum; of line ends as they were written, since version control
    may turn them into those of the system."""
    return hashlib.sha256(data.replace(b"\r\n", b"\n").replace(_seal(stated), _seal(_UNSEALED))).hexdigest()


def _seal(stated: str) -> bytes:
    # With its key, which no text of the file holds like this: there the quotes would be escaped.
    return f'"{CHECKSUM}": "{stated}"'.encode()


def files_of(volume: dict) -> list[str]:
    """Every file a volume's entry names, relative to the bundle."""
    optional = [volume[key] for key in ("offset", "standard_error") if key in volume]
    index = [volume["index"]["file"]] if "index" in volume else []
    return [*volume["sh"], volume["visibility"], volume["validity"], *optional, *index]


def volume_bytes(volume: dict) -> int:
    """How much memory the arrays of a volume's entry take once they are read."""
    probes = math.prod(volume["resolution"])
    nodes = math.prod(volume["index"]["resolution"]) if "index" in volume else 0
    return 4 * probes * (3 * len(volume["sh"]) + 2 * volume["visibility_size"] ** 2 + 3 + 2) + 4 * SLOTS * nodes


def image_header(entry: dict, kind: str, coefficient: int | None = None) -> dict:
    """What the image ``kind`` (an entry's key) of the volume ``entry`` repeats of it, so that it can be read alone."""
    header = {"schema": SCHEMA, "volume": entry["name"], "sh_convention": SH_CONVENTION,
              **{key: entry[key] for key in ("resolution", "world_from_local", "sample_placement", "sh_order", "tiles")},
              "kind": kind}
    if kind == "sh":
        header["coefficient"] = coefficient
    elif kind == "visibility":
        header |= {"tiles": entry["visibility_tiles"], "visibility_size": entry["visibility_size"]}
    elif kind == "index":
        header |= {"resolution": entry["index"]["resolution"], "tiles": entry["index"]["tiles"]}
    return header


def _check_manifest(manifest: dict, where: str) -> None:
    _MANIFEST(manifest, where)
    if not manifest["volumes"]:
        raise Refused("it has no volumes")
    for volume in manifest["volumes"]:
        _check_volume(volume, f"volume {quoted(volume['name'])}:")
    named = [name for volume in manifest["volumes"] for name in files_of(volume)]
    named += [manifest[key] for key in ("lpv", "media", "transfer", "spheres", "atlas", "voxels") if key in manifest]
    digests = manifest["sha256"]
    for names in (named, digests):
        _require_different(names)
    unchecked = next((name for name in named if name not in digests), None)
    if unchecked is not None:
        raise Refused(f"file {unchecked!r} has no checksum")
    # Both came in together, so that neither can be lost unnoticed.
    stated = manifest["stats"].get(CHECKSUM)
    if (stated is None) != ("bytes" not in manifest):
        raise Refused(f"{f'stats.{CHECKSUM}' if stated is None else 'bytes'} is missing")
    if stated is not None:
        digest(stated, f"stats.{CHECKSUM}")
    if "bytes" in manifest and manifest["bytes"].keys() != digests.keys():
        raise Refused("bytes and sha256 name different files")


def _require_different(names) -> None:
    seen: set[str] = set()
    for name in names:
        # Where case does not count, as on Windows, these would be one file.
        if name.lower() in seen:
            raise Refused(f"file {name!r} is named twice")
        seen.add(name.lower())


def _check_volume(volume: dict, where: str) -> None:
    if len(volume["sh"]) != (volume["sh_order"] + 1) ** 2:
        raise Refused(f"{where} {len(volume['sh'])} SH files do not make order {volume['sh_order']}")
    for key, cell in (("tiles", 1), ("visibility_tiles", volume["visibility_size"])):
        require_tiles(volume[key], volume["resolution"], f"{where} {key}", cell)
    if "index" in volume:
        require_tiles(volume["index"]["tiles"], volume["index"]["resolution"], f"{where} index.tiles")


def require_tiles(tiles: dict, resolution: list[int], where: str, cell: int = 1) -> None:
    """Raise Refused unless ``tiles`` (columns and rows) hold the slices of ``resolution`` samples of ``cell`` × ``cell`` pixels."""
    columns, rows = tiles["columns"], tiles["rows"]
    nx, ny, nz = resolution
    if columns * rows < nz or (rows - 1) * columns >= nz:
        raise Refused(f"{where}, {columns} × {rows}, are not those of {nz} slices")
    if max(columns * nx, rows * ny) * cell > MAX_SIDE:
        raise Refused(f"{where} make an image of {columns * nx * cell} × {rows * ny * cell} pixels")
