"""The bundle: what docs/formats.md promises about its files, its bytes, its checks and its neighbours."""

import errno
import hashlib
import json
import os
import shutil
import threading
from dataclasses import fields

import numpy as np
import pytest
from kills import needs_fork, refusing, run_killed
from small_bundles import RESOLUTION, assert_same_grid, contents, make_grid, write
from tiny_technique import TILE

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import bundle as bundle_module
from rtgi_addon.exchange.bundle import check_bundle, check_target, read_bundle
from rtgi_addon.exchange.exr import read_exr, write_exr
from rtgi_addon.exchange.schema import MAX_ORDER, RTGI_VERSION
from rtgi_addon.storage.workplace import workplace
from rtgi_addon.techniques.probes.settings import ProbeSettings


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


def test_a_file_and_what_would_lie_in_one_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="is a file"):
        check_target(tmp_path / "file")
    with pytest.raises(BakeError, match="is no folder"):
        check_target(tmp_path / "file" / "out")
    assert check_target(tmp_path / "none" / "out") == tmp_path / "none" / "out" and not (tmp_path / "none").exists()


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EACCES])
def test_a_disk_that_refuses_any_operation_leaves_the_old_bundle_or_the_new(tmp_path, code):
    out, seen, at = tmp_path / "out", set(), 0
    while True:
        at += 1
        write(out, make_grid("Old"))
        before, failure = contents(out), None
        with refusing(at, tmp_path, OSError(code, os.strerror(code))) as names:
            try:
                write(out, make_grid("New"))
            except BakeError as error:
                failure = error
        if len(names) < at:
            break
        assert failure is None or (os.strerror(code).lower() in failure.cause and failure.remedy), names
        found = read_bundle(out).grids[0].volume.name
        assert failure is None or found == "New" or contents(out) == before, names
        seen.add((found, failure is None))
        write(out, make_grid("Next"))
        assert os.listdir(tmp_path) == ["out"], names
    assert {("Old", False), ("New", True)} <= seen and at > 50


@needs_fork
@pytest.mark.slow
def test_a_kill_before_any_operation_leaves_the_old_bundle_or_the_new(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)
    out, seen, at = tmp_path / "out", set(), 0
    while True:
        at += 1
        write(out, make_grid("Old"))
        ended = run_killed(lambda: write(out, make_grid("New")) and None, at, tmp_path)[0] is not None
        everything = contents(tmp_path)
        name = read_bundle(out).grids[0].volume.name
        assert contents(tmp_path) == everything, "reading it changed something"
        seen.add(name)
        write(out, make_grid("Next"))
        assert os.listdir(tmp_path) == ["out"]
        if ended:
            break
    assert seen == {"Old", "New"} and at > 50


def test_a_full_disk_says_so_and_leaves_the_old_file(tmp_path):
    write_exr(tmp_path / "a.exr", {"Y": np.ones((4, 4), np.float32)}, {})
    before = contents(tmp_path)
    with refusing(4, tmp_path, OSError(errno.ENOSPC, "")), pytest.raises(BakeError, match="no space left on device") as caught:
        write_exr(tmp_path / "a.exr", {"Y": np.zeros((4, 4), np.float32)}, {})
    assert "free some space" in caught.value.remedy and contents(tmp_path) == before


@pytest.mark.parametrize("kind", ["sh", "visibility", "validity"])
def test_values_that_are_not_finite_are_never_written(tmp_path, kind):
    grid = make_grid()
    getattr(grid, kind)[2, 1, 0] = np.nan
    with pytest.raises(BakeError, match=rf"'Volume'.*{kind} is not finite at 1 probes, first at \(0, 1, 2\)"):
        write(tmp_path / "out", grid)
    assert not any(tmp_path.iterdir())


def put_aside(out):
    """As a kill leaves it between the two renames that replace a bundle."""
    for at in range(1, 500):
        write(out, make_grid("Old"))
        run_killed(lambda: write(out, make_grid("New")) and None, at, out.parent)
        if not out.exists():
            return
    raise AssertionError("it was never put aside")


@needs_fork
def test_reading_finds_a_bundle_that_was_put_aside_and_mends_nothing(tmp_path):
    out = write(tmp_path / "out", make_grid("Old"))
    before = contents(out)
    put_aside(out)
    assert contents(out) == {}
    everything = contents(tmp_path)
    assert read_bundle(out).grids[0].volume.name == "Old" and check_bundle(out) and check_target(out) == out
    out.mkdir()
    assert read_bundle(out).grids[0].volume.name == "Old"
    assert contents(tmp_path) == everything
    with workplace(out, "test"):
        assert contents(out) == before
    assert os.listdir(tmp_path) == ["out"]


def test_folders_that_are_only_called_like_ours_are_left_alone(tmp_path):
    for name in ("out.rtgi-old", "out.rtgi-new", "out.old", "out.new"):
        write(tmp_path / name, make_grid("Mine"))
    before = contents(tmp_path)
    (tmp_path / "out").mkdir()
    with pytest.raises(BakeError):
        read_bundle(tmp_path / "out")
    write(tmp_path / "out", make_grid("Out"))
    assert {name: data for name, data in contents(tmp_path).items() if not name.startswith("out/")} == before


def test_a_bundle_that_was_changed_since_is_not_replaced(tmp_path):
    out = write(tmp_path / "out")
    (out / "Volume" / "sh0.exr").write_bytes(b"painted over")
    before = contents(tmp_path)
    with pytest.raises(BakeError, match=r"holds Volume/sh0\.exr, which was changed since it was written"):
        check_target(out)
    assert contents(tmp_path) == before


def test_what_is_put_into_a_bundle_while_it_is_replaced_is_named_and_kept(tmp_path, monkeypatch):
    out = write(tmp_path / "out", make_grid("Old"))
    real = bundle_module.replaceable

    def late(path, contents=True):
        ours = real(path, contents)
        (path / "Old" / "notes").write_text("mine")
        return ours

    monkeypatch.setattr(bundle_module, "replaceable", late)
    with workplace(out, "bake") as place:
        with pytest.raises(BakeError, match=r"was replaced while somebody put Old/notes there") as caught:
            write(place, make_grid("New"))
    assert str(place.folder) in caught.value.remedy and read_bundle(out).grids[0].volume.name == "New"
    assert (place.folder / "old/Old/notes").read_text() == "mine"


def test_no_bundle_is_no_bundle(tmp_path):
    with pytest.raises(BakeError, match="there is no bundle"):
        read_bundle(tmp_path / "none")
    with pytest.raises(BakeError, match=r"has no bake\.json"):
        read_bundle(tmp_path)


def test_the_version_is_the_packages(request):
    assert f'version = "{RTGI_VERSION}"' in (request.config.rootpath / "pyproject.toml").read_text()


def test_every_order_that_is_baked_is_read():
    (order,) = (item for item in fields(ProbeSettings) if item.name == "order")
    assert order.metadata["maximum"] == MAX_ORDER


@pytest.mark.parametrize("read", [read_bundle, check_bundle])
def test_another_bake_in_a_folder_of_the_same_number_is_read_anew(tmp_path, monkeypatch, read):
    # As file systems give the number of a removed folder to the next one.
    out, other = write(tmp_path / "out", make_grid("A")), write(tmp_path / "other", make_grid("B"))
    really_read = bundle_module.read_manifest

    def replace_it_meanwhile(path):
        manifest = really_read(path)
        if other.exists():
            for item in list(out.iterdir()):
                shutil.rmtree(item) if item.is_dir() else item.unlink()
            for item in list(other.iterdir()):
                item.rename(out / item.name)
            other.rmdir()
        return manifest

    monkeypatch.setattr(bundle_module, "read_manifest", replace_it_meanwhile)
    found = read(out)
    assert getattr(found, "manifest", found)["volumes"][0]["name"] == "B" and not other.exists()


@pytest.mark.slow
def test_reading_while_another_bake_replaces_it_gives_one_or_the_other(tmp_path):
    out, stop = tmp_path / "out", threading.Event()
    write(out, make_grid("A"))

    def replace_it():
        while not stop.is_set():
            for name in ("B", "A"):
                write(out, make_grid(name))

    writer = threading.Thread(target=replace_it)
    writer.start()
    try:
        found = [read_bundle(out).grids[0].volume.name for _ in range(60)]
    finally:
        stop.set()
        writer.join()
    assert set(found) == {"A", "B"}
