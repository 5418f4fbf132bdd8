"""A bake on the GPU from the panel: the bake's thread asks, Blender's main thread draws."""

import threading
import time

import pytest

from rtgi_addon.blender import worker as worker_module
from rtgi_addon.blender.worker import BakeWorker, KernelsOnMainThread, MainThreadCalls, main_thread
from rtgi_addon.progress import Progress


def finished(worker, poll=True, seconds=120):
    """The outcome, while this thread polls as the modal operator's timer does."""
    end = time.monotonic() + seconds
    while worker.running and time.monotonic() < end:
        if poll:
            worker.poll()
        time.sleep(0.01)
    assert not worker.running
    return worker.outcome


def test_a_call_from_a_thread_runs_on_this_one():
    worker = BakeWorker(lambda progress: main_thread.call(progress, lambda a, b: (a + b, threading.current_thread()), 1, b=2))
    worker.start()
    assert finished(worker).summary == (3, threading.main_thread())


def test_on_the_main_thread_a_call_is_a_call():
    assert MainThreadCalls().call(Progress(), max, 1, 2) == 2


def test_an_exception_goes_to_who_asked():
    worker = BakeWorker(lambda progress: main_thread.call(progress, [].pop))
    worker.start()
    assert "IndexError" in finished(worker).error


def test_a_bake_that_nobody_serves_ends_when_it_is_cancelled():
    ran = []
    worker = BakeWorker(lambda progress: main_thread.call(progress, ran.append, 1))
    worker.start()
    worker.cancel()
    assert finished(worker, poll=False).cancelled
    # What it had asked for is not done later.
    main_thread.serve()
    assert not ran


def test_a_cancelled_bake_asks_for_nothing_more():
    ran = []

    def bake(progress):
        progress.cancel()
        main_thread.call(progress, ran.append, 1)

    worker = BakeWorker(bake)
    worker.start()
    assert finished(worker).cancelled and not ran


def test_kernels_are_reached_by_their_names():
    class Kernels:
        def lpv_propagate(self, volume, *, steps, progress):
            return volume * steps

    def bake(progress):
        return KernelsOnMainThread(Kernels(), progress).lpv_propagate(3, steps=2, progress=progress)

    worker = BakeWorker(bake)
    worker.start()
    assert finished(worker).summary == 6
    with pytest.raises(AttributeError):
        KernelsOnMainThread(Kernels(), Progress()).magic()


def test_one_turn_serves_many_calls_in_a_row(monkeypatch):
    monkeypatch.setattr(worker_module, "_SERVICE", 60.0)
    monkeypatch.setattr(worker_module, "_FOLLOW_UP", 2.0)
    calls, asked = MainThreadCalls(), threading.Event()

    def ask():
        asked.set()
        answers.extend(calls.call(Progress(), threading.current_thread) for _ in range(5))

    answers = []
    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    asked.wait()
    while calls._calls.empty():
        time.sleep(0.001)
    calls.serve()
    thread.join(10)
    assert answers == [threading.main_thread()] * 5


@pytest.fixture
def room(gpu_device, empty_blend, tmp_path):
    """The add-on in a lit room with the GPU chosen."""
    import rtgi_addon
    bpy = empty_blend
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT")
    bpy.context.object.data.energy = 100
    bpy.ops.object.lightprobe_add(type="VOLUME")
    probe = bpy.context.object.data
    probe.resolution_x = probe.resolution_y = probe.resolution_z = 2
    settings = bpy.context.scene.rtgi
    settings.technique, settings.device, settings.output = "rsm", "GPU", str(tmp_path / "bake")
    yield bpy
    rtgi_addon.unregister()


def test_the_workers_thread_draws_through_the_main_one(room, tmp_path, monkeypatch):
    from rtgi_addon.blender.bake_job import prepare
    from rtgi_addon.preview import capture
    threads = []
    drawn = capture.capture
    monkeypatch.setattr(capture, "capture", lambda *words: threads.append(threading.current_thread()) or drawn(*words))
    worker = BakeWorker(prepare(room.context))
    worker.start()
    outcome = finished(worker)
    assert not outcome.error and (tmp_path / "bake/bake.json").exists()
    assert len(threads) == 6 and set(threads) == {threading.main_thread()}


def test_the_operator_bakes_on_the_gpu(room, tmp_path):
    assert room.ops.rtgi.bake() == {"FINISHED"}
    assert (tmp_path / "bake/bake.json").exists()


def test_a_technique_without_the_gpu_bakes_on_the_cpu_whatever_the_switch_says(room, tmp_path):
    room.context.scene.rtgi.technique = "probes"
    assert room.ops.rtgi.bake() == {"FINISHED"}
