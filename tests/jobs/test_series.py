"""A series of bundles: what is baked, shared and kept, what a stop leaves, and what else is refused."""

import json
from dataclasses import replace

import pytest
import scene_builders as build

from rtgi_addon.errors import BakeError, Cancelled
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.exchange.series import INDEX, bundle_at, is_series, read_series
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.series import bake_series, frames_text
from rtgi_addon.progress import Progress

SETTINGS = {"rays": 64}


class Film:
    """A lamp that brightens until frame 3 and then stays; ``read`` lists the frames that were asked for."""

    def __init__(self, brightness=lambda frame: min(frame, 3)):
        self.read, self._brightness = [], brightness

    def __call__(self, frame, progress):
        progress.step(0.5, "reading")
        self.read.append(frame)
        return build.closed_box(0.5, intensity=float(self._brightness(frame)))


def bake(film, frames, out, **options):
    return bake_series(film, frames, "probes", SETTINGS, out, frames_per_second=lambda: 25.0, threads=1, **options)


def bytes_of(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*/*.exr"))}


def test_every_frame_is_a_bake_and_frames_alike_share_one(tmp_path):
    done = bake(Film(), range(1, 6), tmp_path / "film", seed=4)
    assert [(entry.frame, entry.bundle) for entry in done.series.frames] == [
        (1, "frame_0001"), (2, "frame_0002"), (3, "frame_0003"), (4, "frame_0003"), (5, "frame_0003")]
    assert done.shared == ((4, 3), (5, 3)) and done.kept == () and sorted(done.baked) == [1, 2, 3]
    assert sorted(item.name for item in tmp_path.iterdir()) == ["film"]
    assert sorted(item.name for item in (tmp_path / "film").iterdir()) == ["frame_0001", "frame_0002", "frame_0003", INDEX]
    alone = bake_scene(Film()(2, Progress()), "probes", SETTINGS, tmp_path / "alone", seed=4, threads=1).out
    assert bytes_of(alone) == bytes_of(tmp_path / "film" / "frame_0002") != bytes_of(tmp_path / "film" / "frame_0001")
    assert read_series(tmp_path / "film") == done.series and done.series.frames_per_second == 25.0
    assert "5 frames in 3 bundles" in done.to_text() and "shared   4, 5" in done.to_text()
    assert json.loads(json.dumps(done.to_json()))["frames"][3]["bundle"] == "frame_0003"
    # Each with the seconds of its own.
    seconds = [sum(read_bundle(path).manifest["stats"]["seconds"].values()) for path in done.series.bundles]
    assert done.seconds == pytest.approx(sum(seconds), rel=0.5)


def test_a_frame_shows_the_last_one_before_it(tmp_path):
    series = bake(Film(lambda frame: 1 + frame % 7), range(-4, 9, 4), tmp_path / "film").series
    assert [entry.bundle for entry in series.frames] == ["frame_minus_0004", "frame_0000", "frame_0004", "frame_0008"]
    found = [bundle_at(series, frame) for frame in (-9, 0, 3.5, 4, 100)]
    assert [path.name for path, _ in found] == ["frame_minus_0004", "frame_0000", "frame_0000", "frame_0004", "frame_0008"]
    assert [bool(told) for _, told in found] == [True, False, True, False, True]
    assert found[2][1] == ("Frame 3.5 shows the bake of frame 0",)


def test_a_stopped_series_keeps_what_it_has_and_goes_on(tmp_path):
    progress = Progress()

    class Stopped(Film):
        def __call__(self, frame, part):
            if frame == 3:
                progress.cancel()
            return super().__call__(frame, part)

    with pytest.raises(Cancelled, match="2 of 4 frames are baked, --resume goes on"):
        bake(Stopped(), range(1, 5), tmp_path / "film", progress=progress)
    assert [entry.frame for entry in read_series(tmp_path / "film").frames] == [1, 2]
    before = (tmp_path / "film" / "frame_0001" / "bake.json").stat().st_mtime_ns
    done = bake(Film(), range(1, 5), tmp_path / "film", resume=True)
    assert done.kept == (1, 2) and sorted(done.baked) == [3] and done.shared == ((4, 3),)
    assert (tmp_path / "film" / "frame_0001" / "bake.json").stat().st_mtime_ns == before
    whole = bake(Film(), range(1, 5), tmp_path / "again")
    assert bytes_of(tmp_path / "film" / "frame_0003") == bytes_of(tmp_path / "again" / "frame_0003")
    assert whole.series.frames == done.series.frames


def test_what_has_changed_is_baked_again_and_no_bundle_stands_for_another(tmp_path):
    bake(Film(), range(1, 4), tmp_path / "film")
    # The frames of before, in another order.
    done = bake(Film(lambda frame: 4 - frame), range(1, 4), tmp_path / "film", resume=True)
    assert done.kept == (2,) and sorted(done.baked) == [1, 3]
    bright = [read_bundle(path).grids[0].sh[..., 0, :].mean() for path in done.series.bundles]
    assert bright[0] == pytest.approx(3.0 * bright[2], rel=1e-4)


def test_a_frame_that_fails_is_named_and_leaves_the_others(tmp_path):
    def film(frame, progress):
        scene = Film()(frame, progress)
        return replace(scene, meshes=(), instances=()) if frame == 2 else scene

    with pytest.raises(BakeError, match=r"frame 2: .*geometry"):
        bake(film, range(1, 4), tmp_path / "film")
    assert [entry.frame for entry in read_series(tmp_path / "film").frames] == [1]


def test_nothing_else_is_replaced(tmp_path):
    scene = Film()(1, Progress())
    bundle = bake_scene(scene, "probes", SETTINGS, tmp_path / "bundle", threads=1).out
    with pytest.raises(BakeError, match="holds a bundle, and no series"):
        bake(Film(), range(1, 3), bundle)
    bake(Film(), range(1, 3), tmp_path / "film")
    with pytest.raises(BakeError, match="holds frame_0001, which is not part of a bundle"):
        bake_scene(scene, "probes", SETTINGS, tmp_path / "film", threads=1)
    with pytest.raises(BakeError, match="is a series of bundles, and one is wanted: give the folder of one of its frames"):
        read_bundle(tmp_path / "film")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(BakeError, match=r"letter\.txt"):
        bake(Film(), range(1, 3), tmp_path / "mine")
    assert is_series(tmp_path / "film") and not is_series(bundle)


@pytest.mark.parametrize(("change", "words"), [
    ({"frames": []}, "its frames are none"), ({"schema": "rtgi-series/9"}, "rtgi-series/9"), ({"step": 0}, "step"),
    ({"frames": [{"frame": 1, "bundle": "../else", "state": "0" * 64}]}, "bundle"),
    ({"frames": [{"frame": 1, "bundle": "a/b", "state": "0" * 64}]}, "folder beside it"),
    ({"frames": [{"frame": frame, "bundle": "a", "state": "0" * 64} for frame in (2, 1)]}, "not in order"), ({"more": 1}, "more")])
def test_a_damaged_index_is_refused(tmp_path, change, words):
    series = bake(Film(), range(1, 2), tmp_path / "film").series
    document = json.loads((series.path / INDEX).read_text())
    (series.path / INDEX).write_text(json.dumps({**document, **change}))
    with pytest.raises(BakeError, match=words):
        read_series(series.path)


def test_frames_in_words():
    assert frames_text([1, 2, 3, 4]) == "1 to 4" and frames_text([1, 3, 5, 7]) == "1 to 7 by 2"
    assert frames_text([1, 2]) == "1, 2" and frames_text([1, 2, 3, 10, 20, 21]) == "1 to 3, 10, 20, 21"
