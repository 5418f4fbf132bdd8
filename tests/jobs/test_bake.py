"""The bake job with a technique that bakes numbers: determinism, checkpoints, cancel, failures, the old bundle."""

import json
from dataclasses import replace

import numpy as np
import pytest
import tiny_technique
from scene_builders import closed_box, point_light, volume

from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.fingerprint import fingerprint
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Omission


@pytest.fixture(autouse=True)
def only_tiny(monkeypatch):
    tiny_technique.install(monkeypatch)


@pytest.fixture
def scene():
    return replace(closed_box(), volumes=(volume("A", (3, 4, 5)), volume("B", (2, 2, 3), center=(0.1, 0.0, 0.0))))


def bake(scene, out, overrides=None, **options):
    return bake_scene(scene, "tiny", overrides, out, **options)


def result(out):
    """Everything in the bundle that must not depend on the run."""
    files = {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*.exr")}
    manifest = json.loads((out / "bake.json").read_text())
    del manifest["stats"]
    return files, manifest


def stop_at(fraction):
    """A Progress whose user cancels at ``fraction``."""
    progress = Progress(lambda done, *_: done >= fraction and progress.cancel(), interval=0.0)
    return progress


def test_a_bake_ends_in_a_bundle_and_a_summary(tmp_path, scene):
    scene = replace(scene, notes=("read with care",))
    summary = bake(scene, tmp_path / "out", {"order": 2, "direct": True}, seed=4)
    bundle = read_bundle(tmp_path / "out")
    assert [grid.volume.name for grid in bundle.grids] == ["A", "B"] and bundle.grids[0].order == 2
    assert bundle.manifest["seed"] == 4 and bundle.manifest["settings"]["order"] == 2 and bundle.manifest["includes_direct"]
    outside, = summary.warnings  # two small volumes in a room
    assert bundle.manifest["notes"] == ["read with care", outside] and "outside every probe volume" in outside
    assert bundle.manifest["stats"]["rays"] == summary.rays == 7 * (60 + 12)
    assert {"check", "bake", "write"} <= summary.seconds.keys() and summary.peak_memory_bytes > 2**20
    assert [(v.name, v.probes, v.usable) for v in summary.volumes] == [("A", 60, 60), ("B", 12, 12)]
    assert summary.out == tmp_path / "out" and not summary.resumed
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_what_is_not_followed_is_in_bundle_and_summary_with_how_much_it_concerns(tmp_path, scene):
    hair = Omission("fur is hair: it is left out", ("fur",), boxes_world=np.array([[[-0.9, -0.9, -0.9], [0.9, 0.9, -0.8]]]))
    summary = bake(replace(scene, omissions=(hair, Omission("lamp shines elsewhere", ("nothing",)))), tmp_path / "out")
    unknown, fur = summary.not_followed
    assert unknown.share is None and fur.omission is hair and 0.05 < fur.share < 0.4
    assert f"omitted  fur is hair: it is left out (concerns {100 * fur.share:.2g} % of the light at the probes, estimated)" in \
        summary.to_text()
    stored = read_bundle(tmp_path / "out").manifest["not_followed"]
    assert stored == [unknown.to_json(), fur.to_json()] and summary.to_json()["not_followed"] == stored


def test_the_seed_decides_the_bytes_and_the_threads_do_not(tmp_path, scene):
    for name, options in {"one": {"threads": 1}, "two": {"threads": 2}, "other": {"seed": 1}}.items():
        bake(scene, tmp_path / name, **options)
    assert result(tmp_path / "one") == result(tmp_path / "two")
    assert result(tmp_path / "one")[0] != result(tmp_path / "other")[0]


@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.6, 0.8])
def test_cancel_and_resume_end_in_the_same_bytes(tmp_path, scene, fraction):
    bake(scene, tmp_path / "whole")
    with pytest.raises(Cancelled):
        bake(scene, tmp_path / "out", progress=stop_at(fraction), checkpoint_seconds=0.0)
    assert not (tmp_path / "out").exists()
    summary = bake(scene, tmp_path / "out", resume=True)
    assert summary.resumed == (fraction > 0.0)
    assert (summary.stats["loaded"] > 0) == summary.resumed
    assert result(tmp_path / "out") == result(tmp_path / "whole")
    assert not (tmp_path / "out.partial").exists()


def test_a_cancelled_bake_leaves_the_old_bundle(tmp_path, scene):
    bake(scene, tmp_path / "out")
    before = result(tmp_path / "out")
    with pytest.raises(Cancelled):
        bake(scene, tmp_path / "out", {"order": 3}, progress=stop_at(0.5))
    assert result(tmp_path / "out") == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_cancel_that_comes_after_the_writing_is_too_late(tmp_path, scene):
    progress = Progress(lambda done, label, *_: label.startswith("Writing") and progress.cancel(), interval=0.0)
    assert bake(scene, tmp_path / "out", progress=progress).rays
    assert len(read_bundle(tmp_path / "out").grids) == 2


def test_resume_with_a_change_is_refused_and_without_it_starts_over(tmp_path, scene):
    with pytest.raises(Cancelled):
        bake(scene, tmp_path / "out", progress=stop_at(0.6), checkpoint_seconds=0.0)
    brighter = replace(scene, lights=(point_light(intensity=2.0),))
    for changed, options, words in ((brighter, {}, "lights of the scene"), (scene, {"seed": 1}, "seed"),
                                    (scene, {"overrides": {"order": 0}}, "setting order")):
        with pytest.raises(BakeError, match=words):
            bake(changed, tmp_path / "out", resume=True, **options)
    summary = bake(scene, tmp_path / "out", seed=1)
    assert summary.stats["loaded"] == 0


def test_a_workers_exception_arrives_as_such(tmp_path, scene):
    bake(scene, tmp_path / "out")
    before = result(tmp_path / "out")
    with pytest.raises(ZeroDivisionError, match="the worker divided by zero"):
        bake(scene, tmp_path / "out", {"fail_at": 2}, checkpoint_seconds=0.0)
    assert result(tmp_path / "out") == before


def test_a_result_that_is_not_finite_is_no_bundle(tmp_path, scene):
    with pytest.raises(BakeError, match="not finite"):
        bake(scene, tmp_path / "out", {"not_finite": True})
    assert not any(tmp_path.iterdir())


def test_volumes_are_chosen_by_name(tmp_path, scene):
    bake(scene, tmp_path / "out", volume="B")
    assert [grid.volume.name for grid in read_bundle(tmp_path / "out").grids] == ["B"]
    bake(scene, tmp_path / "out", volume=["B", "A"])
    assert [grid.volume.name for grid in read_bundle(tmp_path / "out").grids] == ["A", "B"]
    with pytest.raises(UsageError, match=r"unknown volume 'C': choose one of A, B"):
        bake(scene, tmp_path / "out", volume="C")


def test_an_override_wins_over_a_volumes_own_setting(tmp_path, scene, monkeypatch):
    seen = []
    monkeypatch.setattr(tiny_technique.TinyTechnique, "bake",
                        lambda self, scene, *_, **__: seen.append(scene.volumes[0].settings) or pytest.fail("seen"))
    own = replace(scene, volumes=(replace(scene.volumes[0], settings={"order": 3, "rays": 9}),))
    for overrides, expected in (({"order": 1}, {"rays": 9}), ({}, {"order": 3, "rays": 9})):
        with pytest.raises(pytest.fail.Exception):
            bake(own, tmp_path / "out", overrides, base={"order": 2})
        assert seen.pop() == expected


def test_the_scenes_settings_are_the_base_of_the_overrides(tmp_path, scene):
    bake(scene, tmp_path / "out", {"order": 3}, base={"order": 2, "direct": True})
    settings = read_bundle(tmp_path / "out").manifest["settings"]
    assert settings["order"] == 3 and settings["direct"]


@pytest.mark.parametrize(("options", "error", "words"), [
    ({"technique": "magic"}, UsageError, r"unknown technique 'magic': choose one of tiny"),
    ({"overrides": {"order": 9}}, UsageError, "order is 9: give a value from 0 to 4"),
    ({"overrides": {"shine": 1}}, UsageError, "technique 'tiny' has no setting 'shine': choose one of order, rays"),
    ({"overrides": {"rays": "many"}}, UsageError, "rays is 'many': give a whole number"),
    ({"device": "gpu"}, BakeError, "does not bake on the device 'gpu': use --device cpu"),
])
def test_wrong_calls_are_refused_before_anything_is_touched(tmp_path, scene, options, error, words):
    with pytest.raises(error, match=words):
        bake_scene(scene, **{"technique": "tiny", "out": tmp_path / "out", **options})
    assert not any(tmp_path.iterdir())


def test_a_scene_without_light_or_geometry_is_refused(tmp_path, scene):
    for broken, words in ((replace(scene, lights=()), "light"), (replace(scene, instances=()), "geometry")):
        with pytest.raises(BakeError, match=words):
            bake(broken, tmp_path / "out")
    assert not any(tmp_path.iterdir())


def test_a_warning_reaches_summary_and_bundle(tmp_path, scene):
    far = replace(scene, volumes=(volume("Far", (2, 2, 2), center=(500.0, 0.0, 0.0)),))
    summary = bake(far, tmp_path / "out")
    assert any("Far" in warning for warning in summary.warnings)
    assert set(summary.warnings) <= set(read_bundle(tmp_path / "out").manifest["notes"])
    assert "warning" in summary.to_text()


def test_the_fingerprint_sees_content_not_identity(scene):
    settings = tiny_technique.TinyTechnique.Settings()
    same = closed_box()
    same = replace(same, volumes=scene.volumes, source="/elsewhere/x.blend", notes=("other",))
    assert fingerprint(scene, "tiny", settings, 0) == fingerprint(same, "tiny", settings, 0)
    vertices = scene.meshes[0].vertices_local.copy()
    vertices[0, 0] = np.nextafter(vertices[0, 0], 9, dtype=np.float32)
    moved = replace(scene, meshes=(replace(scene.meshes[0], vertices_local=vertices),))
    before, after = fingerprint(scene, "tiny", settings, 0), fingerprint(moved, "tiny", settings, 0)
    assert [name for name in before if before[name] != after[name]] == ["meshes of the scene"]
