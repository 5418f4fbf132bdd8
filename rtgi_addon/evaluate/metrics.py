"""How far an estimate is from its reference: errors, bias, energy and leaks, with the reference's own variance taken out.

Arrays are SH coefficients (n, k, 3) or irradiances (n, 3): the first axis counts probes or points, and all that follows belongs
to one of them. Sums are in float64. ``variance`` is the squared standard error of the reference (plus the estimate's, if it is to
be forgiven as well), of the arrays' shape. Definitions, x for the estimate and r for the reference: docs/physics.md §4.
"""

from typing import NamedTuple

import numpy as np

from ..numerics.sampling import hash_u32

# Resamples of the bootstrap, and their seed.
RESAMPLES, BOOTSTRAP_SEED = 400, 7
# Signed errors are relative to the truth, or to this share of its mean where that is more.
FAINT = 0.1


class Figure(NamedTuple):
    """A measured ``value`` and its ``standard_error`` over probes or points."""

    value: float
    standard_error: float


def relative_rmse(estimate, reference, variance=None) -> float:
    """√(max(Σ(x − r)² − Σ variance, 0) / Σr²): infinite for a wrong answer to a black reference, 0 for a right one."""
    squared, power = _relative_sums(estimate, reference, variance)
    return _root_ratio(squared.sum(), power.sum())


def relative_rmse_figure(estimate, reference, variance=None) -> Figure:
    """``relative_rmse`` with a standard error from a bootstrap over probes."""
    squared, power = _relative_sums(estimate, reference, variance)
    return _bootstrap(lambda rows: _root_ratio(squared[rows].sum(), power[rows].sum()), len(squared))


def relative_rmse_of_sites(parts) -> Figure:
    """``relative_rmse_figure`` over several kinds of places together: ``parts`` are (estimate, reference, variance) of (n, …) each,
    with an n and a shape of their own; each first axis counts sites that weigh the same, however many values they have. The
    bootstrap draws among all of them."""
    sums = [np.array(_relative_sums(*part)) / max(1, np.asarray(part[0])[0].size) for part in parts if len(part[0])]
    squared, power = (np.concatenate(arrays) for arrays in zip(*sums, strict=True))
    return _bootstrap(lambda rows: _root_ratio(squared[rows].sum(), power[rows].sum()), len(squared))


def noise_of_sites(parts) -> float:
    """The standard error that noise alone gives ``relative_rmse_of_sites`` of ``parts`` at these very sites: of squares of normal
    differences, whose variance is 4 d² σ² + 2 σ⁴."""
    spread = error = power = 0.0
    for estimate, reference, variance in parts:
        if not len(estimate):
            continue
        values = np.asarray(estimate)[0].size
        squared, square = _relative_sums(estimate, reference, variance)
        differences, noise = np.square(np.subtract(estimate, reference)), np.broadcast_to(variance, np.shape(estimate))
        spread += float(np.sum(4.0 * np.maximum(differences - noise, 0.0) * noise + 2.0 * noise**2)) / values**2
        error, power = error + float(squared.sum()) / values, power + float(square.sum()) / values
    if power <= 0.0:
        return 0.0
    value, added = _root_ratio(error, power), np.sqrt(spread) / power
    # Where hardly anything differs the root is not linear: there it is the root of what noise adds.
    return float(min(added / (2.0 * value), np.sqrt(added))) if value > 0.0 else float(np.sqrt(added))


def signed_error(estimate: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(x − r)/max(r, FAINT·mean r), (n,) from luminances (n,): positive is too bright. Without any light, x itself."""
    level = FAINT * float(truth.mean())
    return (estimate - truth) / np.maximum(truth, level) if level > 0 else estimate


def relmse(estimate, reference, epsilon: float = 1e-2) -> float:
    """mean((x − r)²/(r² + ε)) with ``epsilon`` relative to the mean square of the reference, so that units do not matter."""
    x, r = _pair(estimate, reference)
    floor = epsilon * float(np.mean(r * r))
    if floor == 0.0:
        return 0.0 if not np.any(x) else np.inf
    return float(np.mean((x - r) ** 2 / (r * r + floor)))


def signed_bias(estimate, reference) -> Figure:
    """Σ(x − r)/Σr, of the l = 0 coefficients alone where the arrays are SH (n, k, 3), with its standard error over probes.

    The standard error is that of a ratio of sums (linearised); it shrinks with the number of probes if their errors do not share
    a cause.
    """
    x, r = (_per_probe(values) for values in _pair(estimate, reference))
    total = r.sum()
    if total == 0.0:
        return Figure(0.0 if not np.any(x) else np.inf, np.nan)
    value = float((x - r).sum() / total)
    count = len(r)
    residual = (x - r) - value * r
    error = np.sqrt(count / (count - 1) * np.sum(residual**2)) / abs(total) if count > 1 else np.nan
    return Figure(value, float(error))


def energy_ratio(estimate, reference) -> Figure:
    """Σx/Σr: 1 where no energy is lost or made."""
    bias = signed_bias(estimate, reference)
    return Figure(1.0 + bias.value, bias.standard_error)


def leak_ratio(estimate, dark, lit) -> float:
    """Mean of ``estimate`` over the probes ``dark`` (n,) bool, which get no light, relative to that over the probes ``lit``."""
    values = _per_probe(np.asarray(estimate, np.float64))
    bright = float(values[lit].mean())
    leaked = float(np.abs(values[dark]).mean())
    if bright == 0.0:
        return 0.0 if leaked == 0.0 else np.inf
    return leaked / bright


def _relative_sums(estimate, reference, variance) -> tuple[np.ndarray, np.ndarray]:
    """Per probe: Σ(x − r)² − Σ variance, and Σr²."""
    x, r = _pair(estimate, reference)
    axes = tuple(range(1, x.ndim))
    squared = np.sum((x - r) ** 2, axis=axes)
    if variance is not None:
        squared = squared - np.sum(np.broadcast_to(np.asarray(variance, np.float64), x.shape), axis=axes)
    return squared, np.sum(r * r, axis=axes)


def _pair(estimate, reference) -> tuple[np.ndarray, np.ndarray]:
    x, r = np.asarray(estimate, np.float64), np.asarray(reference, np.float64)
    if x.shape != r.shape:
        raise ValueError(f"estimate {x.shape} and reference {r.shape} differ in shape")
    return x, r


def _per_probe(values: np.ndarray) -> np.ndarray:
    """One signed number a probe: the sum over channels, of the constant coefficient alone where there are several."""
    if values.ndim >= 3:
        values = values[:, 0]
    return values.reshape(len(values), -1).sum(axis=1)


def _root_ratio(squared: float, power: float) -> float:
    if power <= 0.0:
        return 0.0 if squared <= 0.0 else np.inf
    return float(np.sqrt(max(squared, 0.0) / power))


def _bootstrap(statistic, n: int) -> Figure:
    value = statistic(np.arange(n))
    if n < 2:
        return Figure(value, np.nan)
    draws = [hash_u32(BOOTSTRAP_SEED, i, np.arange(n)) % np.uint32(n) for i in range(RESAMPLES)]
    return Figure(value, float(np.std([statistic(rows) for rows in draws], ddof=1)))
