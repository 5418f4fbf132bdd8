"""Costs are those of the work alone: its rays, and the memory it held at its peak."""

import sys
import time

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.evaluate import costs
from rtgi_addon.evaluate.costs import metered
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.rays.ray_counter import count_rays

MEBIBYTE = 1 << 20


def test_every_ray_is_counted_once_however_many_threads():
    tracer = LightContext(build.closed_box(), 2).tracer
    origins, directions = np.zeros((200_000, 3), np.float32), np.tile(np.float32([0, 0, 1]), (200_000, 1))
    with count_rays() as outer:
        tracer.intersect(origins[:7], directions[:7])
        with metered() as inner:
            tracer.intersect(origins, directions)
            tracer.occluded(origins[:1000], directions[:1000])
    tracer.intersect(origins[:5], directions[:5])
    assert inner.rays == 201_000 and outer.rays == 201_007


def peak_of(work) -> float:
    """MiB that ``work`` took at its peak."""
    with metered() as measured:
        work()
    return measured.peak_bytes / MEBIBYTE


def held_for_a_moment():
    """64 MiB, gone at the end."""
    block = np.ones(64 * MEBIBYTE, np.uint8)
    time.sleep(0.1)
    assert block[-1] == 1


@pytest.mark.skipif(sys.platform not in ("linux", "darwin"), reason="memory is measured another way there")
@pytest.mark.parametrize("resettable", [True, False])
def test_memory_that_is_freed_again_counts_and_is_forgotten(monkeypatch, resettable):
    if resettable and not costs._reset_peak():
        pytest.skip("this system keeps no peak that can be reset")
    if not resettable:
        monkeypatch.setattr(costs, "_reset_peak", lambda: False)
    assert 62 < peak_of(held_for_a_moment) < 75
    # The peak of the work before is not this one's.
    assert peak_of(lambda: None) < 8
    assert 62 < peak_of(held_for_a_moment) < 75


def test_seconds_are_the_works():
    with metered() as measured:
        time.sleep(0.05)
    assert measured.seconds >= 0.05 and measured.cpu_seconds < measured.seconds + 0.5 and measured.rays == 0
