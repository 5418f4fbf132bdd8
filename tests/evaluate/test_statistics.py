"""Intervals hold what they promise, and noise is told from what all seeds share."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtgi_addon.evaluate.references import Truth
from rtgi_addon.evaluate.statistics import interval, log_interval, spread


def test_the_interval_covers_the_mean_as_often_as_it_says():
    rng = np.random.default_rng(3)
    for count in (2, 3, 20):
        trials = rng.normal(5.0, 2.0, (2000, count))
        covered = np.mean([found.low <= 5.0 <= found.high for found in map(interval, trials)])
        # 95 % ± 4.5 standard errors of a share over 2,000 trials.
        assert covered == pytest.approx(0.95, abs=0.022), count


def test_one_seed_has_no_interval():
    assert interval([2.0]) == log_interval([2.0]) == type(interval([2.0]))(2.0, None, None)


def test_a_logarithmic_interval_scales_and_stays_positive():
    one, ten = log_interval([1.0, 2.0, 4.0]), log_interval([10.0, 20.0, 40.0])
    assert one.mean == pytest.approx(2.0) and 0 < one.low < 2.0 < one.high
    assert (ten.low, ten.high) == pytest.approx((10 * one.low, 10 * one.high))
    assert log_interval([0.0, 1.0]).low == 0.0 and log_interval([0.0, 1.0]).high == 1.0


def test_systematic_error_noise_and_reference_noise_come_apart():
    rng = np.random.default_rng(0)
    exact = np.full((4000, 3), 10.0)
    reference = Truth(exact + rng.normal(0, 0.3, exact.shape), np.full(exact.shape, 0.09))
    yard = SimpleNamespace(truth_for=lambda *_: reference)
    runs = [SimpleNamespace(errors={"surface": SimpleNamespace(error=0.1)},
                            estimates={"surface": exact + 0.5 + rng.normal(0, 0.8, exact.shape)}) for _ in range(4)]
    found = spread(yard, None, runs, "surface")
    assert found.systematic == pytest.approx(0.05, rel=0.05) and found.random == pytest.approx(0.08, rel=0.05)
    assert spread(yard, None, runs[:1], "surface").random is None
