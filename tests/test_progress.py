"""The bar and the time left: never backwards, and by the pace of the latest part of the work."""

import pytest

from rtgi_addon import progress as module
from rtgi_addon.errors import Cancelled
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.probes.shares import TEXEL_COST, USUAL, Shares


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still until it is turned; and a Progress that began at its beginning, with what it reported."""
    now = [0.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    reported = []
    return now, Progress(lambda *report: reported.append(report), interval=0.0), reported


def test_the_time_left_follows_the_latest_pace(clock):
    """A slow beginning, 100 s for the first tenth, then a tenth every 2 s: by the whole of it 102 s would be left at 30 %."""
    now, progress, reported = clock
    for second in range(0, 101, 10):
        now[0] = second
        progress.step(0.001 * second)
    for tenth in range(2, 9):
        now[0] += 2.0
        progress.step(0.1 * tenth)
    fraction, _, left = reported[-1]
    assert fraction == pytest.approx(0.8) and left < 0.8 * now[0] * 0.2 / 0.8
    now[0] += 500.0
    progress.step(0.81)
    assert reported[-1][2] > 100.0


def test_the_bar_never_runs_backwards(clock):
    _, progress, reported = clock
    for fraction in (0.1, 0.5, 0.3, 0.6):
        progress.step(fraction)
    fractions = [report[0] for report in reported]
    assert fractions == sorted(fractions) == [0.1, 0.5, 0.5, 0.6]


def test_a_span_without_length_shows_what_is_done_and_stops(clock):
    _, progress, reported = clock
    progress.step(0.4, "case")
    inner = progress.span(0.4, 0.4)
    inner.step(0.9, "baking")
    assert reported[-1][:2] == (pytest.approx(0.4), "baking")
    progress.cancel()
    with pytest.raises(Cancelled):
        inner.step(0.95)


def test_a_batchs_parts_are_as_long_as_they_cost():
    assert USUAL.traced == pytest.approx(0.4) and USUAL.grown < USUAL.solved == pytest.approx(0.6)
    first = Shares.of(rays=1e5, new=TEXEL_COST * 64 * 1e4, texels=10000)
    assert first.traced < 0.05 and first.grown > 0.7 and first.solved > 0.95 and first.texels == 10000
