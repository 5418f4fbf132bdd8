"""Error figures on made-up probes whose errors are known."""

import numpy as np
import pytest

from rtgi_addon.evaluate import metrics


def probes(n=500, seed=0):
    """SH-like references (n, 9, 3) with a positive constant term."""
    rng = np.random.default_rng(seed)
    reference = rng.normal(scale=0.2, size=(n, 9, 3))
    reference[:, 0] = rng.uniform(1.0, 3.0, (n, 3))
    return reference, rng


def test_relative_rmse_of_a_scaled_copy_is_the_scale():
    reference, _ = probes()
    assert metrics.relative_rmse(1.02 * reference, reference) == pytest.approx(0.02)
    assert metrics.relative_rmse(reference, reference) == 0.0


def test_the_references_own_variance_is_subtracted():
    truth, rng = probes(4000)
    deviation = 0.1
    measured = truth + rng.normal(scale=deviation, size=truth.shape)
    estimate = truth * 1.03
    variance = np.full(truth.shape, deviation**2)
    power = np.sqrt(np.sum(truth**2) / np.sum(measured**2))
    assert metrics.relative_rmse(estimate, measured) > 0.1
    assert metrics.relative_rmse(estimate, measured, variance) == pytest.approx(0.03 * power, rel=0.1)
    assert metrics.relative_rmse(truth, measured, 4 * variance) == 0.0


def test_bootstrap_error_matches_the_spread_over_new_scenes():
    figures = []
    for seed in range(60):
        reference, rng = probes(100, seed)
        per_probe = rng.lognormal(-4, 0.5, (100, 1, 1))
        figures.append(metrics.relative_rmse_figure(reference + per_probe * rng.normal(size=reference.shape), reference))
    spread = np.std([figure.value for figure in figures])
    claimed = np.median([figure.standard_error for figure in figures])
    assert 0.7 < claimed / spread < 1.4
    again = metrics.relative_rmse_figure(reference * 1.01, reference)
    assert again.value == pytest.approx(0.01) and again.standard_error < 1e-9


def test_relmse_does_not_depend_on_units():
    reference, rng = probes()
    estimate = reference + rng.normal(scale=0.1, size=reference.shape)
    assert metrics.relmse(estimate, reference) == pytest.approx(metrics.relmse(1e3 * estimate, 1e3 * reference))
    assert metrics.relmse(1.1 * reference, reference, epsilon=1e-12) == pytest.approx(0.01, rel=1e-3)


def test_bias_is_signed_and_noise_averages_out_of_it():
    reference, rng = probes(2000)
    estimate = reference * 0.98
    estimate[:, 1:] += 5.0
    noisy = estimate + rng.normal(scale=0.3, size=reference.shape)
    assert metrics.signed_bias(estimate, reference).value == pytest.approx(-0.02)
    figure = metrics.signed_bias(noisy, reference)
    assert abs(figure.value + 0.02) < 5 * figure.standard_error and 1e-3 < figure.standard_error < 5e-3
    assert metrics.energy_ratio(estimate, reference).value == pytest.approx(0.98)


def test_bias_of_irradiance_counts_every_channel():
    reference = np.array([[1.0, 2.0, 3.0], [2.0, 2.0, 2.0]])
    blue = np.array([[0, 0, 0.6], [0, 0, 0]])
    assert metrics.signed_bias(reference + blue, reference).value == pytest.approx(0.6 / 12)


def test_bias_standard_error_is_that_of_repeated_measurements():
    values, errors = [], []
    for seed in range(200):
        reference, rng = probes(50, seed)
        figure = metrics.signed_bias(reference + rng.normal(scale=0.2, size=reference.shape), reference)
        values.append(figure.value)
        errors.append(figure.standard_error)
    assert np.mean(errors) == pytest.approx(np.std(values), rel=0.2)


def test_leak_ratio_compares_rooms():
    reference, _ = probes(10)
    dark = np.arange(10) < 4
    estimate = reference.copy()
    estimate[dark] = 0.0
    assert metrics.leak_ratio(estimate, dark, ~dark) == 0.0
    estimate[dark] = 0.01 * reference[~dark].mean(axis=0)
    assert metrics.leak_ratio(estimate, dark, ~dark) == pytest.approx(0.01)
    # Negative leaks are leaks too.
    assert metrics.leak_ratio(np.where(dark[:, None, None], -estimate, estimate), dark, ~dark) == pytest.approx(0.01)


def test_black_references_ask_for_black():
    black, light = np.zeros((3, 4, 3)), np.ones((3, 4, 3))
    for metric in (metrics.relative_rmse, metrics.relmse, lambda x, r: metrics.signed_bias(x, r).value):
        assert metric(black, black) == 0.0 and metric(light, black) == np.inf


def test_shapes_must_match():
    with pytest.raises(ValueError, match="shape"):
        metrics.relative_rmse(np.zeros((2, 3)), np.zeros((3, 3)))


def test_sites_of_several_kinds_weigh_the_same():
    ones = np.ones((4, 14, 3)), np.ones((4, 1, 3))
    parts = [(2 * ones[0], ones[0], np.zeros((4, 14, 3))), (ones[1], ones[1], np.zeros((4, 1, 3)))]
    assert metrics.relative_rmse_of_sites(parts).value == pytest.approx(np.sqrt(0.5))
    assert metrics.noise_of_sites(parts) == 0.0


@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_the_noise_of_a_difference_is_that_of_repeated_measurements(offset):
    rng = np.random.default_rng(4)
    truth, sigma = rng.uniform(0.5, 1.5, (60, 1, 3)), 0.1
    variance = np.full_like(truth, sigma**2)

    def measured():
        return [(truth * (1 + offset) + rng.normal(0, sigma, truth.shape), truth, variance)]

    values = [metrics.relative_rmse_of_sites(measured()).value for _ in range(60)]
    told = np.mean([metrics.noise_of_sites(measured()) for _ in range(20)])
    if offset:
        assert told == pytest.approx(np.std(values), rel=0.3)
    else:
        assert np.mean(np.array(values) > 1.645 * told) < 0.1
