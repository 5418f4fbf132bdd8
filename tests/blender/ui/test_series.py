"""A series from the panel: a bundle a frame, kept frames, cancel, and where Blender is afterwards."""

import json
import threading
import time

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from fake_technique import FakeTechnique  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.techniques import registry  # noqa: E402


@pytest.fixture
def fake(monkeypatch, empty_blend, tmp_path):
    """The add-on registered with a technique of our own, in a room whose lamp moves from frame 3 on; frames 1, 3 and 5."""
    technique = FakeTechnique()
    monkeypatch.setitem(registry(), "fake", technique)
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT")
    lamp = bpy.context.object
    for frame, x in ((3, 0.0), (5, 1.0)):
        lamp.location.x = x
        lamp.keyframe_insert("location", frame=frame)
    bpy.ops.object.lightprobe_add(type="VOLUME")
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 5, 2
    scene.frame_set(4)
    scene.rtgi.technique, scene.rtgi.output = "fake", str(tmp_path / "bake")
    yield technique
    rtgi_addon.unregister()


def index(tmp_path):
    return json.loads((tmp_path / "bake" / "series.json").read_text())


def test_every_frame_of_the_scenes_range_has_a_bundle(fake, tmp_path):
    assert bpy.ops.rtgi.bake_frames() == {"FINISHED"}
    found = {entry["frame"]: entry["bundle"] for entry in index(tmp_path)["frames"]}
    # The lamp stands still until frame 3: the two frames share a bundle.
    assert list(found) == [1, 3, 5] and found[1] == found[3] != found[5] and len(fake.bakes) == 2
    assert [scene.lights[0].position_world[0] for scene, _ in fake.bakes] == [0.0, 1.0]
    assert bpy.context.scene.frame_current == 4
    # Again: nothing has changed.
    assert bpy.ops.rtgi.bake_frames() == {"FINISHED"} and len(fake.bakes) == 2


def test_what_the_panel_says_is_what_frames_are_baked_with(fake, tmp_path):
    bpy.context.scene.rtgi.technique_fake.order = 4
    bpy.ops.rtgi.bake_frames()
    assert {settings.order for _, settings in fake.bakes} == {4} and index(tmp_path)["settings"]["order"] == 4


def test_a_folder_with_the_bake_of_one_frame_is_left_alone(fake, tmp_path):
    assert bpy.ops.rtgi.bake() == {"FINISHED"}
    with pytest.raises(RuntimeError, match="holds the bake of one frame"):
        bpy.ops.rtgi.bake_frames()
    assert (tmp_path / "bake" / "bake.json").is_file() and bpy.context.scene.frame_current == 4


def test_frames_are_read_on_the_main_thread_and_the_rest_can_be_cancelled(fake, tmp_path):
    """As the window's ticks do it: a worker bakes, and what it asks for is done here."""
    from rtgi_addon.blender import frames
    from rtgi_addon.blender.bake_job import prepare_series
    from rtgi_addon.blender.worker import BakeWorker
    readers, set_frame = [], frames.extract_scene

    def noted(**options):
        readers.append(threading.current_thread())
        return set_frame(**options)

    def run(stop_after=None):
        worker = BakeWorker(prepare_series(bpy.context))
        worker.start()
        end = time.monotonic() + 60
        while worker.poll() and time.monotonic() < end:
            if stop_after is not None and len(fake.bakes) >= stop_after:
                worker.cancel()
        return worker

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(frames, "extract_scene", noted)
        fake.seconds = 0.5
        stopped = run(stop_after=2)
        assert stopped.outcome.cancelled and [entry["frame"] for entry in index(tmp_path)["frames"]] == [1, 3]
        fake.seconds = 0.0
        whole = run()
    assert whole.outcome.summary.kept == (1,) and list(whole.outcome.summary.baked) == [5]
    assert readers and set(readers) == {threading.main_thread()}
