"""The bundle: what FORMATS.md promises about its files, its bytes, its checks and its neighbours."""

import errno
import hashlib
import json
import os

import numpy as np
import pytest
from scene_builders import closed_box, volume
from tiny_technique import TILE, TinyField, tiny_grid

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import bundle as bundle_module
from rtgi_addon.exchange.bundle import check_bundle, check_target, read_bundle, write_bundle
from rtgi_addon.exchange.exr import read_exr, write_exr
from rtgi_addon.exchange.schema import RTGI_VERSION

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
    manifest = json.loads((folder / "bake.json").read_text())
    change(manifest)
    (folder / "bake.json").write_text(json.dumps(manifest))


def reseal(folder, name):
    """Give a changed file the checksum it now has."""
    digest = hashlib.sha256((folder / name).read_bytes()).hexdigest()
    edit_manifest(folder, lambda manifest: manifest["sha256"].update({name: digest}))


def assert_same_grid(found, expected):
    for kind in ("sh", "validity", "visibility", "offset_world", "standard_error"):
        assert np.array_equal(getattr(found, kind), getattr(expected, kind), equal_nan=True), kind
        assert getattr(found, kind).dtype == np.float32
    assert found.volume.name == expected.volume.name
    assert found.volume.resolution == expected.volume.resolution
    assert np.array_equal(found.volume.world_from_local, expected.volume.world_from_local)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_round_trip(tmp_path, order):
    rng = np.random.default_rng(2)
    offset = np.zeros((*RESOLUTION[::-1], 3), np.float32)
    offset[1, 2, 0] = (0.1, -0.2, 0.3)
    grids = (make_grid("A", order, validity=rng.random(RESOLUTION[::-1], dtype=np.float32)),
             make_grid("B", order, seed=1, offset_world=offset,
                       standard_error=np.full(RESOLUTION[::-1], np.nan, np.float32)))
    bundle = read_bundle(write(tmp_path / "out", *grids))
    assert len(bundle.grids) == 2
    for found, expected in zip(bundle.grids, grids, strict=True):
        assert_same_grid(found, expected)
        assert found.order == order


def test_files_and_manifest_are_the_published_format(tmp_path):
    out = write(tmp_path / "out", notes=["a note"])
    manifest = json.loads((out / "bake.json").read_text())
    (entry,) = manifest["volumes"]
    assert set(contents(out)) == {"bake.json", *manifest["sha256"]}
    assert {f"Volume/sh{i}.exr" for i in range(4)} | {"Volume/visibility.exr", "Volume/validity.exr"} <= set(contents(out))
    assert manifest["schema"] == "rtgi-bundle/1"
    assert manifest["sh_convention"] == "real-orthonormal, no Condon-Shortley, radiance, Z-up"
    assert manifest["technique"] == "tiny" and manifest["seed"] == 3 and manifest["settings"] == {"order": 1}
    assert manifest["stats"]["rays"] == 9 and manifest["notes"] == ["a note"]
    assert entry["resolution"] == [3, 4, 5] and entry["sample_placement"] == "cell-centred" and entry["sh_order"] == 1
    assert entry["world_from_local"][0] == [1.0, 0.0, 0.0, 0.5] and entry["tiles"] == {"columns": 1, "rows": 5}
    for name, digest in manifest["sha256"].items():
        assert hashlib.sha256((out / name).read_bytes()).hexdigest() == digest


def test_each_image_can_be_read_alone(tmp_path):
    grid = make_grid(validity=np.random.default_rng(2).random(RESOLUTION[::-1], dtype=np.float32))
    out = write(tmp_path / "out", grid)
    planes, metadata = read_exr(out / "Volume/sh2.exr")
    assert set(planes) == {"R", "G", "B"} and planes["R"].shape == (5 * 4, 3)
    assert metadata["coefficient"] == 2 and metadata["resolution"] == [3, 4, 5] and metadata["tiles"] == {"columns": 1, "rows": 5}
    assert metadata["sh_convention"].startswith("real-orthonormal") and metadata["sample_placement"] == "cell-centred"
    z, y, x = 3, 1, 2
    assert planes["G"][z * 4 + y, x] == grid.sh[z, y, x, 2, 1]
    planes, metadata = read_exr(out / "Volume/visibility.exr")
    assert set(planes) == {"R", "G"} and metadata["visibility_size"] == TILE
    top, left = (z * 4 + y) * TILE, x * TILE
    assert np.array_equal(planes["G"][top:top + TILE, left:left + TILE], grid.visibility[z, y, x, :, :, 1])
    planes, _ = read_exr(out / "Volume/validity.exr")
    assert planes["Y"][z * 4 + y, x] == grid.validity[z, y, x]


def test_the_same_bake_gives_the_same_bytes_but_for_the_stats(tmp_path):
    first, second = (contents(write(tmp_path / name, seconds=time)) for name, time in (("a", 1.0), ("b", 2.0)))
    assert first.keys() == second.keys()
    assert {name for name in first if first[name] != second[name]} == {"bake.json"}
    manifests = [json.loads(files["bake.json"]) for files in (first, second)]
    assert manifests[0].pop("stats") != manifests[1].pop("stats")
    assert manifests[0] == manifests[1]


def test_an_earlier_bundle_is_replaced_whole(tmp_path):
    write(tmp_path / "out", make_grid("Old"))
    (tmp_path / "out" / ".DS_Store").write_text("a file browser was here")
    write(tmp_path / "out", make_grid("New"))
    assert [grid.volume.name for grid in read_bundle(tmp_path / "out").grids] == ["New"]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert not (tmp_path / "out" / "Old").exists()


def test_volumes_with_clashing_names_keep_apart(tmp_path):
    grids = [make_grid(name, seed=index) for index, name in enumerate(("a/b", "a_b", "A_B", "bake.json"))]
    bundle = read_bundle(write(tmp_path / "out", *grids))
    for found, expected in zip(bundle.grids, grids, strict=True):
        assert_same_grid(found, expected)


@pytest.mark.parametrize("make", [
    lambda folder: (folder / "notes.txt").write_text("mine"),
    lambda folder: (folder / "sub").mkdir(),
])
def test_a_folder_of_something_else_is_not_replaced(tmp_path, make):
    (tmp_path / "out").mkdir()
    make(tmp_path / "out")
    before = sorted((tmp_path / "out").iterdir())
    with pytest.raises(BakeError, match="not part of a bundle"):
        write(tmp_path / "out")
    assert sorted((tmp_path / "out").iterdir()) == before


def test_a_bundle_with_a_file_of_the_user_is_not_replaced(tmp_path):
    out = write(tmp_path / "out")
    (out / "Volume" / "mine.png").write_text("keep me")
    with pytest.raises(BakeError, match=r"holds Volume/mine\.png"):
        check_target(out)
    assert (out / "Volume" / "mine.png").exists()


def test_an_empty_folder_is_taken(tmp_path):
    (tmp_path / "out").mkdir()
    assert len(read_bundle(write(tmp_path / "out")).grids) == 1


def test_a_file_or_a_missing_parent_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="is a file"):
        check_target(tmp_path / "file")
    with pytest.raises(BakeError, match="does not exist"):
        check_target(tmp_path / "none" / "out")
    with pytest.raises(BakeError, match="does not exist"):
        check_target(tmp_path / "file" / "out")


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EACCES, errno.EROFS])
@pytest.mark.parametrize("stage", ["write_exr", "sync_file", "write_atomically", "swap_folder", "sync_folder"])
def test_a_disk_that_refuses_leaves_the_old_bundle(tmp_path, monkeypatch, code, stage):
    out = write(tmp_path / "out", make_grid("Old"))
    before = contents(out)

    def refuse(*_, **__):
        raise OSError(code, os.strerror(code), "somewhere")

    monkeypatch.setattr(bundle_module, stage, refuse)
    with pytest.raises(BakeError, match=f"(?i){os.strerror(code)}") as caught:
        write(out, make_grid("New"))
    assert caught.value.remedy
    assert contents(out) == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_full_disk_under_openexr_says_so(tmp_path):
    if not os.path.exists("/dev/full"):
        pytest.skip("this system has no /dev/full")
    with pytest.raises(BakeError, match="no space left on device") as caught:
        write_exr("/dev/full", {"Y": np.ones((4, 4), np.float32)}, {})
    assert "free some space" in caught.value.remedy


@pytest.mark.parametrize("kind", ["sh", "visibility", "validity"])
def test_values_that_are_not_finite_are_never_written(tmp_path, kind):
    grid = make_grid()
    getattr(grid, kind)[2, 1, 0] = np.nan
    with pytest.raises(BakeError, match=rf"'Volume'.*{kind} is not finite at 1 probes, first at \(0, 1, 2\)"):
        write(tmp_path / "out", grid)
    assert not any(tmp_path.iterdir())


def test_a_swap_that_was_killed_is_mended(tmp_path):
    out = write(tmp_path / "out", make_grid("Old"))
    before = contents(out)
    out.rename(tmp_path / "out.rtgi-old")
    assert read_bundle(out).grids[0].volume.name == "Old"
    assert contents(out) == before
    # Killed after the new folder took its place, before the old one was removed.
    write(tmp_path / "out.rtgi-old", make_grid("Older"))
    assert check_target(out) == out
    assert contents(out) == before and not (tmp_path / "out.rtgi-old").exists()


@pytest.mark.parametrize("name", ["Volume/sh0.exr", "Volume/visibility.exr", "Volume/validity.exr"])
def test_a_truncated_or_altered_file_is_named(tmp_path, name):
    out = write(tmp_path / "out")
    data = (out / name).read_bytes()
    for damaged in (data[:len(data) // 2], b"", data[:-1] + bytes([data[-1] ^ 1])):
        (out / name).write_bytes(damaged)
        with pytest.raises(BakeError, match="checksum") as caught:
            check_bundle(out)
        assert str(out / name) in caught.value.cause
    (out / name).unlink()
    with pytest.raises(BakeError, match="is missing"):
        read_bundle(out)


def test_a_resealed_file_of_another_size_or_value_is_named(tmp_path):
    out = write(tmp_path / "out")
    planes, metadata = read_exr(out / "Volume/sh1.exr")
    write_exr(out / "Volume/sh1.exr", {name: plane[:-1] for name, plane in planes.items()}, metadata)
    reseal(out, "Volume/sh1.exr")
    with pytest.raises(BakeError, match=r"sh1\.exr has the wrong size"):
        read_bundle(out)
    planes["B"][3, 1] = np.inf
    write_exr(out / "Volume/sh1.exr", planes, metadata)
    reseal(out, "Volume/sh1.exr")
    with pytest.raises(BakeError, match=r"sh1\.exr holds values that are not finite"):
        read_bundle(out)
    write_exr(out / "Volume/sh1.exr", {"Y": planes["R"]}, metadata)
    reseal(out, "Volume/sh1.exr")
    with pytest.raises(BakeError, match=r"sh1\.exr has channels Y instead of R, G, B"):
        read_bundle(out)


@pytest.mark.parametrize("change", [
    lambda manifest: manifest.pop("volumes"),
    lambda manifest: manifest.update(sh_convention="something else"),
    lambda manifest: manifest["volumes"][0].update(resolution=[3, 4]),
    lambda manifest: manifest["volumes"][0].update(sh_order=2),
    lambda manifest: manifest["volumes"][0].update(tiles={"columns": 1, "rows": 2}),
    lambda manifest: manifest["volumes"][0].update(world_from_local=[[1.0]]),
    lambda manifest: manifest["volumes"][0].update(validity="../../secret.exr"),
    lambda manifest: manifest["sha256"].pop("Volume/sh0.exr"),
    lambda manifest: manifest.update(volumes=[3]),
])
def test_a_manifest_that_contradicts_itself_is_refused(tmp_path, change):
    out = write(tmp_path / "out")
    edit_manifest(out, change)
    with pytest.raises(BakeError, match=r"bake\.json is damaged, ") as caught:
        read_bundle(out)
    assert str(out) in caught.value.cause


@pytest.mark.parametrize(("text", "match"), [
    ("{", "not JSON"), ("[]", "schema None"), ('{"schema": "rtgi-bundle/9"}', "schema 'rtgi-bundle/9'"), ("\udcff", "is damaged"),
])
def test_a_damaged_manifest_is_refused_and_never_replaced(tmp_path, text, match):
    out = write(tmp_path / "out")
    (out / "bake.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(BakeError, match=match):
        read_bundle(out)
    with pytest.raises(BakeError, match="would be replaced"):
        check_target(out)


def test_no_bundle_is_no_bundle(tmp_path):
    with pytest.raises(BakeError, match="there is no bundle"):
        read_bundle(tmp_path / "none")
    with pytest.raises(BakeError, match=r"has no bake\.json"):
        read_bundle(tmp_path)


def test_the_version_is_the_packages(request):
    assert f'version = "{RTGI_VERSION}"' in (request.config.rootpath / "pyproject.toml").read_text()
