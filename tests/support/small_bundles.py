"""Small bundles for tests, and ways to change what is in one."""

import hashlib
import json

import numpy as np
from scene_builders import closed_box, volume
from tiny_technique import TinyField, tiny_grid

from rtgi_addon.exchange.bundle import write_bundle

RESOLUTION = (3, 4, 5)


def make_grid(name="Volume", order=1, seed=0, **replaced):
    rng = np.random.default_rng(seed)
    sh = rng.normal(size=(*RESOLUTION[::-1], (order + 1) ** 2, 3)).astype(np.float32)
    return tiny_grid(volume(name, RESOLUTION, (1.0, 2.0, 3.0), (0.5, 0.0, -1.0)), sh, **replaced)


def write(out, *grids, seconds=1.0, **options):
    grids = grids or (make_grid(),)
    return write_bundle(out, TinyField(grids, False, {}), closed_box(), settings={"order": 1}, seed=3,
                        stats=lambda: {"rays": np.int64(9), "seconds": {"bake": seconds}}, **options)


def contents(folder):
    """Every file's bytes by relative name."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def edit_manifest(folder, change):
    """Change bake.json and give it the checksum that this makes right, where it has one."""
    manifest = json.loads((folder / "bake.json").read_text())
    change(manifest)
    text, zeros = json.dumps(manifest, indent=1), '"checksum": "' + 64 * "0"
    if "checksum" in manifest.get("stats", {}):
        text = text.replace(f'"checksum": "{manifest["stats"]["checksum"]}', zeros)
        text = text.replace(zeros, '"checksum": "' + hashlib.sha256(text.encode()).hexdigest())
    (folder / "bake.json").write_text(text)


def reseal(folder, name):
    """Give a changed file the size and the checksum that it now has."""
    data = (folder / name).read_bytes()

    def change(manifest):
        manifest["sha256"][name] = hashlib.sha256(data).hexdigest()
        if "bytes" in manifest:
            manifest["bytes"][name] = len(data)

    edit_manifest(folder, change)


def as_before_checksums(folder):
    """Make of a bundle what was written before bake.json had a checksum."""
    edit_manifest(folder, lambda manifest: (manifest["stats"].pop("checksum"), manifest.pop("bytes")))


def assert_same_grid(found, expected):
    for kind in ("sh", "validity", "visibility", "offset_world", "standard_error"):
        assert np.array_equal(getattr(found, kind), getattr(expected, kind), equal_nan=True), kind
        assert getattr(found, kind).dtype == np.float32
    assert found.volume.name == expected.volume.name
    assert found.volume.resolution == expected.volume.resolution
    assert np.array_equal(found.volume.world_from_local, expected.volume.world_from_local)
