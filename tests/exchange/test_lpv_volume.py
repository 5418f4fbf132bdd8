"""Light propagation volumes as files: round trip, a bundle's checksums, damage, values that are not finite."""

import json
from pathlib import Path

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.exchange.exr import read_exr
from rtgi_addon.exchange.lpv_volume import read_lpv_volume, write_lpv_volume
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.techniques.lpv.field import LpvField
from rtgi_addon.techniques.lpv.grid import LpvGrid

SETTINGS = {"resolution": 8, "steps": 12, "map_resolution": 16, "cascades": 2}


def field(value=None):
    """Two cascades of different shapes with a random value in every cell."""
    rng = np.random.default_rng(0)
    grids = (LpvGrid((0.5, -1.0, 2.0), 0.25, (5, 3, 4)), LpvGrid((0.0, -2.0, 1.0), 0.5, (2, 2, 6)))
    volumes = [rng.normal(size=(4, 3, *grid.shape)).astype(np.float32) for grid in grids]
    if value is not None:
        volumes[1][0, 0, 0, 0, 0] = value
    walls = rng.random((6, *grids[0].shape)).astype(np.float32)
    return LpvField(grids, tuple(volumes), (walls, None), params={"dampening": False}, stats={})


def test_files_give_the_field_back(tmp_path):
    written = field()
    names = write_lpv_volume(tmp_path, written)
    assert sorted(names) == sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file())
    back = read_lpv_volume(tmp_path)
    assert back.volume_grids == written.volume_grids and back.params == {"dampening": False}
    assert all(np.array_equal(a, b) for a, b in zip(back.volumes, written.volumes, strict=True))
    assert np.array_equal(back.faces[0], written.faces[0]) and np.all(back.faces[1][:3] == 1) and not back.faces[1][3:].any()
    points, normals = np.random.default_rng(1).uniform(0, 2, (50, 3)), np.tile([0.0, 0, 1], (50, 1))
    assert np.array_equal(back.irradiance(points, normals), written.irradiance(points, normals))


def test_an_image_holds_slices_from_top_to_bottom_and_says_what_it_is(tmp_path):
    written = field()
    write_lpv_volume(tmp_path, written)
    planes, about = read_exr(tmp_path / "lpv/cascade0/sh3.exr")
    assert planes["G"].shape == (4 * 3, 5)
    assert planes["G"][2 * 3 + 1, 4] == written.volumes[0][3, 1, 2, 1, 4]
    assert about["coefficient"] == 3 and about["cell"] == 0.25 and about["resolution"] == [5, 3, 4]


def test_a_bundle_counts_them_and_is_checked(tmp_path):
    out = tmp_path / "out"
    bake_scene(build.closed_box(), "lpv", SETTINGS, out, threads=1)
    bundle = read_bundle(out)
    assert bundle.manifest["technique"] == "lpv" and bundle.manifest["lpv"] == "lpv/lpv.json"
    names = {name for name in bundle.manifest["sha256"] if name.startswith("lpv/")}
    images = [*(f"sh{index}" for index in range(4)), "open", "crossing"]
    assert names == {"lpv/lpv.json", *(f"lpv/cascade{level}/{image}.exr" for level in range(2) for image in images)}
    again = tmp_path / "again"
    bake_scene(build.closed_box(), "lpv", SETTINGS, again, threads=2)
    assert all((out / name).read_bytes() == (again / name).read_bytes() for name in bundle.manifest["sha256"])
    # A second bake replaces them, and one of probes takes them away.
    bake_scene(build.closed_box(), "lpv", SETTINGS, out)
    whole = (out / "lpv/cascade1/sh2.exr").read_bytes()
    (out / "lpv/cascade1/sh2.exr").write_bytes(b"damaged")
    with pytest.raises(BakeError, match=r"lpv/cascade1/sh2\.exr is cut short or damaged"):
        read_bundle(out)
    (out / "lpv/cascade1/sh2.exr").write_bytes(whole)
    bake_scene(build.closed_box(), "probes", {"rays": 16}, out)
    assert not (out / "lpv").exists() and "lpv" not in read_bundle(out).manifest


def test_a_volume_called_lpv_has_its_own_folder(tmp_path):
    scene = build.closed_box(name="lpv")
    bake_scene(scene, "lpv", {**SETTINGS, "cascades": 1}, tmp_path / "out")
    assert read_bundle(tmp_path / "out").grids[0].volume.name == "lpv"
    assert read_lpv_volume(tmp_path / "out").volumes[0].shape == (4, 3, 8, 8, 8)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_not_written(tmp_path, value):
    with pytest.raises(BakeError, match=r"cascade 1 .* is not finite"):
        write_lpv_volume(tmp_path, field(value))


def changed(**changes):
    """A change of the first cascade's entry; None takes a key away."""
    def change(path):
        index = json.loads(path.read_text())
        entry = index["cascades"][0]
        index["cascades"][0] = {key: value for key, value in {**entry, **changes}.items() if value is not None}
        path.write_text(json.dumps(index))

    return change


def other_schema(path: Path):
    path.write_text(json.dumps({**json.loads(path.read_text()), "schema": "rtgi-lpv/9"}))


@pytest.mark.parametrize(("damage", "words"), [
    (lambda path: path.write_text("{"), "is damaged, it is not JSON"), (other_schema, "has schema 'rtgi-lpv/9'"),
    (changed(cell=None), r"is damaged, cascades\[0\]\.cell is missing"), (changed(cell=0), "cell is 0, not from"),
    (changed(resolution=[9, 9, 9]), r"tiles, 1 × 4, are not those of 9 slices"),
    (changed(resolution=[3, 5, 4]), "pixels instead of"), (changed(corner=[0, 0, 0]), "they differ in corner"),
    (changed(sh=["../sh0.exr"] * 4), "names no file inside the folder"), (Path.unlink, "cannot read")])
def test_damage_is_named(tmp_path, damage, words):
    write_lpv_volume(tmp_path, field())
    damage(tmp_path / "lpv/lpv.json")
    with pytest.raises(BakeError, match=words):
        read_lpv_volume(tmp_path)
