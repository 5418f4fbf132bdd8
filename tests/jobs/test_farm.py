"""Bakes on a cluster of real worker processes of Dask's `distributed`."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest
import room_scenes as rooms
from bundle_bytes import same_bundle

from rtgi_addon.errors import BakeError, Cancelled
from rtgi_addon.jobs import farm
from rtgi_addon.jobs.prepare import prepare_scene
from rtgi_addon.jobs.prepared_bake import bake_prepared, merge_parts
from rtgi_addon.progress import Progress

distributed = pytest.importorskip("distributed", reason="Dask's distributed is not installed (pip install 'rtgi[farm]')")
pytestmark = pytest.mark.slow
PARTS = 6


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """A folder with the prepared bake `prep` of 8 blocks and its bundle `whole`."""
    folder = tmp_path_factory.mktemp("farm")
    scene = rooms.two_rooms(resolution=(16, 12, 10), half_size=(2.0, 0.95, 0.95))
    assert prepare_scene(scene, "probes", {"error": 0.1}, folder / "prep").blocks == 8
    bake_prepared(folder / "prep", folder / "whole")
    return folder


@pytest.fixture(scope="module")
def cluster():
    """A scheduler with three workers, each a process of its own."""
    with distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None,
                                  silence_logs=50) as cluster:
        yield cluster


def test_a_farm_gives_the_very_bytes_and_leaves_nothing_behind(work, cluster, tmp_path):
    told = []
    progress = Progress(lambda fraction, label, left: told.append(label), interval=0.0)
    summary = farm.farm_bake(work / "prep", cluster.scheduler_address, PARTS, tmp_path / "out", progress=progress)
    assert same_bundle(work / "whole", tmp_path / "out") and summary.out == tmp_path / "out"
    assert any(f"of {PARTS} parts, 3 workers" in label for label in told)
    assert [item.name for item in tmp_path.iterdir()] == ["out"]


def test_parts_that_stand_are_kept_and_damaged_ones_made_again(work, cluster, tmp_path, monkeypatch):
    for number in (1, 2):
        bake_prepared(work / "prep", tmp_path / f"out.parts/{number}-of-{PARTS}", part=(number, PARTS))
    (tmp_path / f"out.parts/2-of-{PARTS}/blocks.bin").write_bytes(b"cut short")
    submitted = []
    monkeypatch.setattr(farm._Run, "_submit", lambda run, number, place, workers=None, submit=farm._Run._submit: (
        submitted.append(number), submit(run, number, place, workers)))
    with pytest.raises(BakeError, match=r"part 2: .*changed since"):
        farm.farm_bake(work / "prep", cluster.scheduler_address, PARTS, tmp_path / "out")
    assert 1 not in submitted and 2 in submitted
    shutil.rmtree(tmp_path / f"out.parts/2-of-{PARTS}")
    farm.farm_bake(work / "prep", cluster.scheduler_address, PARTS, tmp_path / "out")
    assert same_bundle(work / "whole", tmp_path / "out")


def test_a_worker_that_dies_is_replaced(work, cluster, tmp_path, monkeypatch):
    began, killed = threading.Event(), []

    def kill():
        began.wait(60)
        time.sleep(0.3)
        killed.append(next(iter(cluster.workers.values())).pid)
        os.kill(killed[0], signal.SIGKILL)

    monkeypatch.setattr(farm._Run, "_help_slow", lambda run, done, took: began.set())
    killer = threading.Thread(target=kill)
    killer.start()
    farm.farm_bake(work / "prep", cluster.scheduler_address, PARTS, tmp_path / "out")
    killer.join()
    assert killed and same_bundle(work / "whole", tmp_path / "out")


def test_a_wish_to_stop_reaches_the_workers_and_the_next_call_goes_on(work, cluster, tmp_path):
    progress = Progress(lambda fraction, label, left: fraction > 0.2 and progress.cancel(), interval=0.0)
    with pytest.raises(Cancelled):
        farm.farm_bake(work / "prep", cluster.scheduler_address, PARTS, tmp_path / "out", progress=progress)
    assert not (tmp_path / "out").exists()
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        until = time.monotonic() + 60
        while any(client.processing().values()) and time.monotonic() < until:
            time.sleep(0.2)
        assert not any(client.processing().values())
    farm.farm_bake(work / "prep", cluster.scheduler_address, PARTS, tmp_path / "out")
    assert same_bundle(work / "whole", tmp_path / "out")


def test_a_command_that_is_killed_goes_on_where_it_was(work, cluster, tmp_path):
    words = [sys.executable, "-m", "rtgi_addon", "farm", str(work / "prep"), "--scheduler", cluster.scheduler_address, "--parts",
             str(PARTS), "--out", str(tmp_path / "out")]
    first, until = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL), time.monotonic() + 120
    while not list((tmp_path / "out.parts").glob("*/part.json")) and time.monotonic() < until:
        time.sleep(0.05)
    first.kill()
    first.wait()
    assert not (tmp_path / "out").exists()
    # Workers end what they had begun once they see that nobody wants it; what then stands is not made again.
    stood = {item.name for item in (tmp_path / "out.parts").iterdir() if (item / "part.json").is_file()}
    assert stood
    again = subprocess.run(words, capture_output=True, text=True, timeout=240)
    assert again.returncode == 0, again.stderr
    assert same_bundle(work / "whole", tmp_path / "out")


def test_a_worker_that_made_a_part_reads_the_bake_no_second_time(work, tmp_path, monkeypatch):
    read = []
    monkeypatch.setattr(farm, "read_prepared", lambda path, real=farm.read_prepared: read.append(path) or real(path))
    monkeypatch.setattr(farm, "_free", {})
    for number in (2, 1):
        ready = farm._take(str(work / "prep"), 1)
        bake_prepared(work / "prep", tmp_path / str(number), part=(number, 2), ready=ready)
        farm._free[str(work / "prep")] = ready
    assert len(read) == 1
    assert same_bundle(work / "whole", merge_parts([tmp_path / "1", tmp_path / "2"], tmp_path / "out").out)
    (tmp_path / "other").mkdir()
    for item in (work / "prep").iterdir():
        shutil.copy(item, tmp_path / "other")
    farm._take(str(tmp_path / "other"), 1)
    assert len(read) == 2 and not farm._free


def test_a_part_that_one_worker_holds_is_begun_again_elsewhere(work, cluster, tmp_path, monkeypatch):
    # A worker ten times as slow as the others: part 1 sleeps there, wherever it is made first.
    def slow(prepared, number, parts, out, stop, make=farm.make_part):
        if number == 1 and not out.endswith("-again"):
            time.sleep(120.0)
        return make(prepared, number, parts, out, stop)

    monkeypatch.setattr(farm, "make_part", slow)
    started = time.monotonic()
    farm.farm_bake(work / "prep", cluster.scheduler_address, PARTS, tmp_path / "out")
    assert time.monotonic() - started < 100.0
    assert same_bundle(work / "whole", tmp_path / "out")


def test_no_scheduler_and_no_workers_are_said(work, tmp_path, monkeypatch):
    monkeypatch.setattr(farm, "_CONNECT", 1.0)
    with pytest.raises(BakeError, match=r"there is no scheduler at tcp://127\.0\.0\.1:9"):
        farm.farm_bake(work / "prep", "tcp://127.0.0.1:9", PARTS, tmp_path / "out")
    with (distributed.LocalCluster(n_workers=0, processes=True, dashboard_address=None, silence_logs=50) as empty,
          pytest.raises(BakeError, match="the cluster has no workers")):
        farm.farm_bake(work / "prep", empty.scheduler_address, PARTS, tmp_path / "out")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("about", "said"), [
    ({"numpy": "1.0"}, "has numpy 1.0, and here it is"), ({"sees": False}, "does not see"), ({"slow": "none"}, "has no Embree")])
def test_workers_that_are_not_alike_are_named(work, cluster, tmp_path, monkeypatch, about, said):
    monkeypatch.setattr(farm, "about_worker", lambda prepared, alike=farm.about_worker: {**alike(prepared), **about})
    with pytest.raises(BakeError, match=rf"worker tcp://.* {said}"):
        farm.farm_bake(work / "prep", cluster.scheduler_address, PARTS, tmp_path / "out")
    assert not list(tmp_path.iterdir())
