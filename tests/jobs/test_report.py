"""The summary: what it counts and how it reads."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scene_builders import volume
from tiny_technique import TinyField, tiny_grid

from rtgi_addon.jobs.report import estimated_error, summarize, volume_summary
from rtgi_addon.scene import Scene


@pytest.fixture
def grid():
    sh = np.full((2, 2, 2, 4, 3), 2.0, np.float32)
    return tiny_grid(volume("V", (2, 2, 2)), sh, standard_error=np.full((2, 2, 2), 0.02, np.float32))


def test_the_error_is_relative_and_of_usable_probes_only(grid):
    assert estimated_error(grid) == pytest.approx(0.01)
    grid.validity[0, 0, 0] = 0.0
    grid.standard_error[0, 0, 0] = 50.0
    assert estimated_error(grid) == pytest.approx(0.01)
    assert volume_summary(grid).usable == 7


def test_an_error_that_is_not_known_is_none(grid):
    grid.standard_error[:] = np.nan
    assert estimated_error(grid) is None
    grid.validity[:] = 0.0
    assert estimated_error(grid) is None


def test_a_dark_room_has_no_error(grid):
    grid.sh[:] = 0.0
    grid.standard_error[:] = 0.0
    assert estimated_error(grid) == 0.0


def test_moved_probes_are_counted(grid):
    grid.offset_world[1, 0, 1] = (0.0, 0.1, 0.0)
    summary = volume_summary(grid)
    assert (summary.moved, summary.usable) == (1, 7)


def test_the_summary_is_json_and_text(tmp_path, grid):
    scene = Scene("s", notes=("fitted a volume",))
    stats = {"rays": np.int64(2_000_000), "seconds": {"bake": 1.5, "write": 0.5}, "peak_memory_bytes": 3 * 2**20,
             "odd": np.float32(np.nan)}
    field = TinyField([replace(grid, volume=replace(grid.volume, fitted=True))], False, {})
    summary = summarize(field, scene, out=tmp_path / "out", technique="tiny", settings={"order": 1}, seed=2,
                        warnings=["too bright: dim it"], resumed=True, stats=stats)
    values = json.loads(json.dumps(summary.to_json(), allow_nan=False))
    assert values["rays"] == 2_000_000 and values["volumes"][0]["usable"] == 8 and values["stats"] == {"odd": None}
    text = summary.to_text()
    for words in ("(resumed)", "2 × 2 × 2 probes, order 1, 100.0 % usable", "noise at probes 1 %", "fitted to the scene",
                  "2,000,000, 1.0 million a second", "2.00 (bake 1.50, write 0.50)", "3 MiB", "fitted a volume",
                  "too bright: dim it"):
        assert words in text
