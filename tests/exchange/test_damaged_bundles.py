"""Bundles that were damaged, changed or made up: refused by one line that names the file, never read as something else."""

import os
import shutil

import numpy as np
import pytest
from small_bundles import as_before_checksums, assert_same_grid, edit_manifest, make_grid, reseal, write

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import bundle as bundle_module
from rtgi_addon.exchange.bundle import check_bundle, check_target, read_bundle
from rtgi_addon.exchange.exr import read_exr, write_exr
from rtgi_addon.exchange.schema import parse_manifest


@pytest.mark.parametrize("name", ["Volume/sh0.exr", "Volume/visibility.exr", "Volume/validity.exr"])
def test_a_truncated_or_altered_file_is_named(tmp_path, name):
    out = write(tmp_path / "out")
    data = (out / name).read_bytes()
    for damaged in (data[:len(data) // 2], b"", data[:-1] + bytes([data[-1] ^ 1])):
        (out / name).write_bytes(damaged)
        for look in (check_bundle, read_bundle):
            with pytest.raises(BakeError, match="cut short or damaged") as caught:
                look(out)
            assert str(out / name) in caught.value.cause
    (out / name).unlink()
    for look in (check_bundle, read_bundle):
        with pytest.raises(BakeError, match=rf"cannot read .*{name}, no such file"):
            look(out)


def test_a_resealed_file_of_another_size_or_value_is_named(tmp_path):
    out = write(tmp_path / "out")
    planes, metadata = read_exr(out / "Volume/sh1.exr")
    write_exr(out / "Volume/sh1.exr", {name: plane[:-1] for name, plane in planes.items()}, metadata)
    reseal(out, "Volume/sh1.exr")
    with pytest.raises(BakeError, match=r"sh1\.exr is cut short or damaged \(3 × 19 pixels instead of 3 × 20\)"):
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


@pytest.mark.parametrize(("change", "words"), [
    (lambda manifest: manifest.pop("volumes"), "volumes is missing"),
    (lambda manifest: manifest.update(volumes=[]), "it has no volumes"),
    (lambda manifest: manifest.update(volumes=[3]), r"volumes\[0\] is a number instead of an object"),
    (lambda manifest: manifest.update(sh_convention="something else"), "sh_convention is 'something else' instead of 'real-ortho"),
    (lambda manifest: manifest.update(seed=True), "seed is True instead of a whole number"),
    (lambda manifest: manifest.update(includes_direct=1), "includes_direct is a number instead of yes or no"),
    (lambda manifest: manifest.update(surprise=1), "'surprise' is unknown"),
    (lambda manifest: manifest.update(notes="x"), "notes is text instead of a list"),
    (lambda manifest: manifest.pop("bytes"), "bytes is missing"),
    (lambda manifest: manifest["stats"].pop("checksum"), r"stats\.checksum is missing"),
    (lambda manifest: manifest["stats"].update(checksum=[]), r"stats\.checksum is \[\] instead of a SHA-256"),
    (lambda manifest: manifest["bytes"].pop("Volume/sh0.exr"), "name different files"),
    (lambda manifest: manifest["bytes"].update({"Volume/sh0.exr": -1}), r"bytes\['Volume/sh0.exr'\] is -1, not at least 0"),
    (lambda manifest: manifest["sha256"].pop("Volume/sh0.exr"), "'Volume/sh0.exr' has no checksum"),
    (lambda manifest: manifest["sha256"].update({"Volume/sh0.exr": "0"}), "instead of a SHA-256"),
    (lambda manifest: manifest["sha256"].update({"Volume/SH0.exr": 64 * "0"}), "'Volume/SH0.exr' is named twice"),
    (lambda manifest: manifest["volumes"][0].update(resolution=[3, 4]), "resolution has 2 entries instead of 3"),
    (lambda manifest: manifest["volumes"][0].update(resolution=[3, 4, 0]), r"resolution\[2\] is 0, not from 1 to"),
    (lambda manifest: manifest["volumes"][0].update(sh_order=2), "4 SH files do not make order 2"),
    (lambda manifest: manifest["volumes"][0].update(sh_order=10**6), "sh_order is 1000000, not from 0 to 8"),
    (lambda manifest: manifest["volumes"][0].update(tiles={"columns": 1, "rows": 2}), "tiles, 1 × 2, are not those of 5 slices"),
    (lambda manifest: manifest["volumes"][0].update(tiles={"columns": 9000, "rows": 1}), "are not those|make an image of"),
    (lambda manifest: manifest["volumes"][0].update(visibility_size=9999), "make an image of"),
    (lambda manifest: manifest["volumes"][0].update(world_from_local=[[1.0]]), "world_from_local has 1 entries instead of 4"),
    (lambda manifest: manifest["volumes"][0]["world_from_local"][1].__setitem__(1, 0.0), "world_from_local has no inverse"),
    (lambda manifest: manifest["volumes"][0]["world_from_local"][3].__setitem__(3, 2.0), "no affine matrix"),
    (lambda manifest: manifest["volumes"][0]["world_from_local"][0].__setitem__(3, 10**400), r"\[0\]\[3\] is 1000.*…, not from"),
    (lambda manifest: manifest["volumes"][0].update(visibility="Volume/sh1.exr"), "'Volume/sh1.exr' is named twice"),
    (lambda manifest: manifest["volumes"].append(manifest["volumes"][0]), "'Volume/sh0.exr' is named twice"),
])
def test_a_manifest_that_contradicts_itself_is_refused(tmp_path, change, words):
    out = write(tmp_path / "out")
    edit_manifest(out, change)
    with pytest.raises(BakeError, match=r"bake\.json is damaged, .*" + words) as caught:
        read_bundle(out)
    assert str(out) in caught.value.cause and "\n" not in caught.value.cause


@pytest.mark.parametrize("name", ["../secret.exr", "/etc/passwd", "Volume/../../secret.exr", "C:/secret.exr", "Volume\\sh0.exr",
                                  "./a", "Volume//sh0.exr", "..", "", "a\0b", "\ud800.exr", "Volume/", "http://a"])
@pytest.mark.parametrize("where", ["volume", "sha256", "bytes"])
def test_a_name_outside_the_bundle_is_refused(tmp_path, name, where):
    out = write(tmp_path / "out")
    (tmp_path / "secret.exr").write_bytes((out / "Volume/validity.exr").read_bytes())

    def change(manifest):
        if where == "volume":
            manifest["volumes"][0]["validity"] = name
        else:
            manifest[where][name] = manifest[where].pop("Volume/validity.exr")

    edit_manifest(out, change)
    with pytest.raises(BakeError, match="names no file inside the folder"):
        read_bundle(out)


def test_a_link_that_leads_outside_is_refused(tmp_path):
    out = write(tmp_path / "out")
    (out / "Volume/validity.exr").rename(tmp_path / "secret.exr")
    (out / "Volume/validity.exr").symlink_to(tmp_path / "secret.exr")
    for look in (check_bundle, read_bundle):
        with pytest.raises(BakeError, match="leads outside"):
            look(out)


@pytest.mark.parametrize("name", ["bake.json", "Volume/sh0.exr", "Volume"])
@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero"), lambda path: path.symlink_to("/dev/stdin")],
                         ids=["pipe", "device", "stdin"])
def test_what_never_ends_is_refused_at_once(tmp_path, name, make):
    out = write(tmp_path / "out")
    if (out / name).is_dir():
        shutil.rmtree(out / name)
    else:
        (out / name).unlink()
    make(out / name)
    for look in (check_bundle, read_bundle):
        with pytest.raises(BakeError, match=r"not a file|leads outside|not a directory"):
            look(out)


def test_no_bit_of_the_manifest_changes_unnoticed(tmp_path):
    out = write(tmp_path / "out", make_grid(order=0))
    data = (out / "bake.json").read_bytes()
    for at in range(len(data)):
        for bit in (0, 2, 5):
            with pytest.raises(BakeError, match=r"bake\.json (is damaged|has schema)"):
                parse_manifest(data[:at] + bytes([data[at] ^ 1 << bit]) + data[at + 1:], out / "bake.json")


def test_line_ends_of_another_system_are_no_change(tmp_path):
    out = write(tmp_path / "out")
    (out / "bake.json").write_bytes((out / "bake.json").read_bytes().replace(b"\n", b"\r\n"))
    assert read_bundle(out).unchecked == ()


def test_a_bundle_from_before_the_checksum_is_read_with_a_note(tmp_path):
    out = write(tmp_path / "out")
    as_before_checksums(out)
    bundle = read_bundle(out)
    assert_same_grid(bundle.grids[0], make_grid())
    assert "no checksum of itself" in bundle.unchecked[0]


@pytest.mark.parametrize(("change", "word"), [
    (lambda volume: volume["world_from_local"][0].__setitem__(3, 0.75), "world_from_local"),
    (lambda volume: volume.update(name="Another"), "volume"),
    (lambda volume: volume["sh"].reverse(), "coefficient"),
    (lambda volume: volume.update(visibility_size=1, visibility_tiles={"columns": 1, "rows": 5}), "pixels instead of"),
    (lambda volume: volume.update(resolution=[4, 3, 5]), "pixels instead of"),
])
def test_what_the_images_repeat_must_be_the_same(tmp_path, change, word):
    """Also in a bundle whose manifest has no checksum, or one that was made right again."""
    for old in (False, True):
        out = write(tmp_path / str(old))
        edit_manifest(out, lambda manifest: change(manifest["volumes"][0]))
        if old:
            as_before_checksums(out)
        with pytest.raises(BakeError, match=word):
            read_bundle(out)


@pytest.mark.parametrize(("kind", "value", "words"), [
    ("validity", 1.5, "not from 0 to 1"), ("visibility", -1.0, "not from 0 to inf"), ("standard_error", -1.0, "not from 0 to inf")])
def test_values_out_of_range_are_named(tmp_path, kind, value, words):
    grid = make_grid()
    getattr(grid, kind)[0, 1, 2] = value
    with pytest.raises(BakeError, match=rf"{kind}\.exr holds values that are {words}"):
        read_bundle(write(tmp_path / "out", grid))


def test_a_bundle_that_does_not_fit_into_memory_says_so(tmp_path, monkeypatch):
    out = write(tmp_path / "out")
    monkeypatch.setattr(bundle_module, "available_bytes", lambda: 1000)
    with pytest.raises(BakeError, match=r"needs 0\.0 GiB of memory"):
        read_bundle(out)


@pytest.mark.parametrize(("text", "match"), [
    ("{", "it is not JSON"), ("", "it is not JSON"), ("[" * 100_000, "it is not JSON"), ("\udcff", "it is not JSON"),
    ("[]", "it holds a list instead of an object"), ("null", "it holds nothing instead of an object"),
    ('{"schema": "rtgi-bundle/9"}', "has schema 'rtgi-bundle/9' instead of 'rtgi-bundle/1'"),
    ('{"schema": "rtgi-bundle/1", "schema": "rtgi-bundle/1"}', "'schema' stands in it twice"),
    ('{"seed": NaN}', "NaN stands for a number"), ('{"seed": 1e999}', "the number '1e999' is too large"),
    ('{"seed": ' + 5000 * "9" + "}", "it is not JSON"), ('{"seed": 1}', "its schema is None instead of 'rtgi-bundle/1'"),
])
def test_a_damaged_manifest_is_refused_and_never_replaced(tmp_path, text, match):
    out = write(tmp_path / "out")
    (out / "bake.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(BakeError, match=match):
        read_bundle(out)
    with pytest.raises(BakeError, match="would be replaced"):
        check_target(out)
