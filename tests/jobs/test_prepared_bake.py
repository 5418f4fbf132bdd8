"""Bakes that travel: prepared once, made whole or in parts, merged to the very bytes."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from bundle_bytes import same_bundle

from rtgi_addon.effects.spheres.settings import SphereSettings
from rtgi_addon.errors import BakeError, Cancelled
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.prepare import prepare_scene
from rtgi_addon.jobs.prepared_bake import bake_prepared, blocks_of, merge_parts
from rtgi_addon.progress import Progress
from rtgi_addon.scene.sphere_probe import SphereProbe
from rtgi_addon.techniques.probes.block_field import Bricks

SETTINGS = {"error": 0.08}

def scene():
    """Two rooms with two volumes, the second with settings of its own: 4 blocks and 1."""
    whole = rooms.two_rooms(resolution=(12, 9, 8), half_size=(2.0, 0.95, 0.95))
    near = build.volume(resolution=(3, 3, 3), half_size=0.4, center=(-1.0, 0.0, 0.0))
    return replace(whole, volumes=(*whole.volumes, replace(near, name="Near", settings={"order": 1})))


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """A folder with the prepared bake `prep`, the bundle `whole`, and its parts `1` to `3`, made on other numbers of threads."""
    folder = tmp_path_factory.mktemp("travels")
    summary = prepare_scene(scene(), "probes", SETTINGS, folder / "prep")
    assert summary.blocks == 5 and summary.probes == 12 * 9 * 8 + 27
    bake_prepared(folder / "prep", folder / "whole")
    for number in (3, 1, 2):
        bake_prepared(folder / "prep", folder / str(number), part=(number, 3), threads=number)
    return folder


def parts(work, *numbers):
    return [work / str(number) for number in numbers or (1, 2, 3)]


def test_parts_are_the_very_bytes_of_the_whole(work, tmp_path):
    merged = merge_parts(parts(work, 2, 3, 1), tmp_path / "merged")
    assert same_bundle(work / "whole", tmp_path / "merged")
    assert merged.rays > 0 and [volume.name for volume in merged.volumes] == [volume.name for volume in scene().volumes]


def test_a_prepared_bake_is_as_good_as_one_of_the_file(work, tmp_path):
    bake_scene(scene(), "probes", {"error": 0.02}, tmp_path / "good")
    good, plain = (read_bundle(folder).grids for folder in (tmp_path / "good", work / "whole"))
    for fine, found in zip(good, plain, strict=True):
        assert found.sh.shape == fine.sh.shape
        np.testing.assert_allclose(found.validity, fine.validity)
        np.testing.assert_allclose(found.offset_world, fine.offset_world, atol=1e-6)
        off = np.sqrt(np.mean((found.sh - fine.sh) ** 2) / np.mean(fine.sh**2))
        assert off < SETTINGS["error"]


def test_no_blender_and_no_file_is_needed(work, tmp_path):
    blocked = "import sys\nfor name in ('bpy', 'mathutils', 'gpu'): sys.modules[name] = None\n"
    code = blocked + "from rtgi_addon.__main__ import main\nraise SystemExit(main())"
    done = subprocess.run([sys.executable, "-c", code, "bake", str(work / "prep"), "--part", "2/3", "--out", str(tmp_path / "2")],
                          capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "2/blocks.bin").read_bytes() == (work / "2/blocks.bin").read_bytes()


class UntilSaved(Progress):
    """Stops a bake to `out` in ``folder`` once its first blocks have been saved."""

    def __init__(self, folder):
        super().__init__()
        self._saved = folder / "out.partial"

    def check(self):
        if list(self._saved.glob("*.part")):
            self.cancel()
        super().check()


def test_an_interrupted_part_goes_on(work, tmp_path):
    with pytest.raises(Cancelled):
        bake_prepared(work / "prep", tmp_path / "out", progress=UntilSaved(tmp_path), checkpoint_seconds=0.0)
    assert not (tmp_path / "out").exists()
    summary = bake_prepared(work / "prep", tmp_path / "out", resume=True)
    assert summary.resumed and same_bundle(work / "whole", tmp_path / "out")
    assert not (tmp_path / "out.partial").exists()


def test_checkpoints_of_another_part_are_not_gone_on_with(work, tmp_path):
    with pytest.raises(Cancelled):
        bake_prepared(work / "prep", tmp_path / "out", part=(1, 2), progress=UntilSaved(tmp_path), checkpoint_seconds=0.0)
    with pytest.raises(BakeError, match="part"):
        bake_prepared(work / "prep", tmp_path / "out", part=(2, 2), resume=True)


def test_sphere_probes_and_the_error_on_surfaces_are_of_a_bake_in_parts_too(tmp_path):
    ball = SphereProbe("Ball", build.transform((-1.0, 0.2, 0.0)), influence_distance=0.8, parallax_distance=1.5)
    whole = replace(rooms.two_rooms(resolution=(4, 3, 3), half_size=(2.0, 0.9, 0.9)), spheres=(ball,))
    small = SphereSettings(resolution="32", rays=2)
    prepare_scene(whole, "probes", SETTINGS, tmp_path / "prep", spheres=small)
    plain = bake_prepared(tmp_path / "prep", tmp_path / "whole")
    for number in (1, 2):
        bake_prepared(tmp_path / "prep", tmp_path / f"parts/{number}", part=(number, 2), threads=number)
    merged = merge_parts([tmp_path / "parts/2", tmp_path / "parts/1"], tmp_path / "merged")
    assert same_bundle(tmp_path / "whole", tmp_path / "merged")
    # What a sphere sees does not hang on the probes: these are the very bytes of a bake of the file.
    direct = bake_scene(whole, "probes", SETTINGS, tmp_path / "direct", spheres=small)
    assert (tmp_path / "merged/spheres/Ball.exr").read_bytes() == (tmp_path / "direct/spheres/Ball.exr").read_bytes()
    for summary in (plain, merged):
        error = summary.error_on_surfaces
        assert error["low"] <= error["value"] <= error["high"] and error == plain.error_on_surfaces
    assert 0.5 < merged.error_on_surfaces["value"] / direct.error_on_surfaces["value"] < 2.0
    prepare_scene(whole, "probes", SETTINGS, tmp_path / "prep", spheres=SphereSettings(bake=False))
    bake_prepared(tmp_path / "prep", tmp_path / "without")
    assert not (tmp_path / "without/spheres").exists()


def test_a_block_is_a_box_of_one_volume_and_all_probes_are_in_one():
    volumes = tuple(build.volume(resolution=resolution) for resolution in ((17, 9, 8), (3, 3, 3)))
    bricks = Bricks(volumes)
    assert len(bricks) == 3 * 2 + 1
    assert np.array_equal(np.sort(np.concatenate(list(bricks))), np.arange(17 * 9 * 8 + 27))
    assert len(Bricks((build.volume(resolution=(80, 64, 64)),))) == 5 * 4 * 4 and len(bricks[0]) == 8**3


def test_blocks_are_shared_out_evenly():
    for blocks, number in ((5, 3), (7, 7), (3, 5), (100, 16)):
        shares = [blocks_of(part, number, blocks) for part in range(1, number + 1)]
        assert [index for share in shares for index in share] == list(range(blocks))
        assert max(map(len, shares)) - min(map(len, shares)) <= 1


def refused(paths, tmp_path, said):
    with pytest.raises(BakeError, match=said):
        merge_parts(paths, tmp_path / "merged")
    assert not (tmp_path / "merged").exists() and not (tmp_path / "merged.partial").exists()


def test_parts_that_do_not_make_a_whole_are_refused(work, tmp_path):
    refused(parts(work, 1, 3), tmp_path, "of 3 parts these are missing: 2")
    refused(parts(work, 1, 2, 3, 2), tmp_path, "are both part 2")
    bake_prepared(work / "prep", tmp_path / "half", part=(1, 2))
    refused([*parts(work), tmp_path / "half"], tmp_path, "one of 2 parts")
    prepare_scene(scene(), "probes", SETTINGS, tmp_path / "prep", seed=1)
    bake_prepared(tmp_path / "prep", tmp_path / "1", part=(1, 3))
    refused([tmp_path / "1", *parts(work, 2, 3)], tmp_path, "of another prepared bake")
    refused([work / "prep"], tmp_path, "is not a part of a bake, it has no part.json")
    refused([tmp_path / "nothing"], tmp_path, "there is no folder")


@pytest.mark.parametrize("name", ["blocks.bin", "about.bin", "part.json"])
def test_a_part_that_is_damaged_is_refused(work, tmp_path, name):
    shutil.copytree(work / "2", tmp_path / "2")
    file = tmp_path / "2" / name
    file.write_bytes(file.read_bytes()[:-7])
    refused([work / "1", tmp_path / "2", work / "3"], tmp_path, f"{name} is damaged")
    file.unlink()
    refused([work / "1", tmp_path / "2", work / "3"], tmp_path, name)


def test_another_version_is_refused(work, tmp_path):
    shutil.copytree(work / "prep", tmp_path / "prep")
    file = tmp_path / "prep/prepared.json"
    document = json.loads(file.read_text())
    for name in ("rtgi", "numpy"):
        file.write_text(json.dumps({**document, name: "0.0.1"}))
        with pytest.raises(BakeError, match=f"was made with {name} 0.0.1"):
            bake_prepared(tmp_path / "prep", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_parts_of_other_kernels_do_not_mix(work, tmp_path):
    shutil.copytree(work / "2", tmp_path / "2")
    file = tmp_path / "2/part.json"
    document = json.loads(file.read_text())
    file.write_text(json.dumps({**document, "kernels": "another"}))
    refused([work / "1", tmp_path / "2", work / "3"], tmp_path, "was made with kernels another")


def test_what_is_no_prepared_bake_is_not_replaced(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out/letter.txt").write_text("mine")
    with pytest.raises(BakeError, match=r"letter\.txt, which is not part of a prepared bake"):
        prepare_scene(scene(), "probes", SETTINGS, tmp_path / "out")
    assert (tmp_path / "out/letter.txt").read_text() == "mine"


def test_what_is_one_piece_is_not_prepared(tmp_path):
    with pytest.raises(BakeError, match="a bake of vpl is one piece"):
        prepare_scene(scene(), "vpl", {}, tmp_path / "out")
    with pytest.raises(BakeError, match="--fit reads all probes at once"):
        prepare_scene(scene(), "probes", {"fit": True}, tmp_path / "out")
    assert not list(tmp_path.iterdir())
