"""The interval of an error over points covers what other points say, where a few of them hold most of it."""

import numpy as np
import pytest

from rtgi_addon.numerics.heavy_tail import interval_of_another_draw, root_ratio


@pytest.mark.parametrize(("name", "least"), [("exponential", 0.9), ("lognormal", 0.85), ("pareto", 0.75)])
def test_the_interval_covers_another_draw(name, least):
    """Pareto squares of exponent 1.5 have a mean and no variance: of two draws the one with the greatest point may be anywhere."""
    rng = np.random.default_rng(3)
    draw = {"exponential": lambda n: rng.exponential(size=n), "lognormal": lambda n: rng.lognormal(0.0, 1.5, n),
            "pareto": lambda n: rng.pareto(1.5, n)}[name]
    covered = bootstrapped = 0
    tries = 60
    for _ in range(tries):
        off, other, power = draw(256), draw(256), 10.0 + rng.random(256)
        low, high = interval_of_another_draw(off, power, 0.95)
        assert low <= root_ratio(off, power) <= high
        said = root_ratio(other, power)
        covered += low <= said <= high
        means = np.sqrt(off[rng.integers(0, 256, (100, 256))].sum(axis=1) / power.sum())
        bootstrapped += np.quantile(means, 0.025) <= said <= np.quantile(means, 0.975)
    assert covered >= least * tries and covered > bootstrapped


def test_nothing_is_invented():
    off, power = np.random.default_rng(1).pareto(1.5, 200), np.ones(200)
    assert interval_of_another_draw(np.zeros(50), np.ones(50), 0.95) == (0.0, 0.0)
    assert root_ratio(-off, power) == 0.0 and root_ratio(off, np.zeros(200)) == 0.0
