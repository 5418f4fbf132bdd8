"""Phase functions: values, Legendre moments, sampling.

The cosine is that between the ways light travels before and after: 1 is straight on. On a ray that looks along d it is d·ω for
light from ω (towards the light), since both turn round. Values are per steradian and integrate to 1.

Sources: L. Henyey and J. Greenstein, ApJ 93, 1941; B. Draine, ApJ 598, 2003 (eq. 7; α = 1 is W. Cornette and J. Shanks, Appl. Opt.
31, 1992; g = 0 with it Rayleigh); G. Fournier and J. Forand, Proc. SPIE 2258, 1994, in the form of Fournier and Jonasz, Proc. SPIE
3761, 1999; J. Jendersie and E. d'Eon, "An Approximate Mie Scattering Function for Fog and Cloud Rendering", SIGGRAPH 2023, with its
supplement. Parameters are held within the limits in which Cycles holds them.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...numerics.sampling import about
from ...scene.medium import DRAINE, FOURNIER_FORAND, HENYEY_GREENSTEIN, MIE, RAYLEIGH, Phase

# Cycles' own limits: how close g comes to ±1, backscatter to ½, an index of refraction to 1.
_MARGIN = 1e-3
# Halvings of the interval [−1, 1] by which a distribution is inverted: to the last bit of a double.
_HALVINGS = 54


@dataclass(frozen=True)
class DraineLobe:
    """(1 + α·cos²)·Henyey-Greenstein, normalized: all of HENYEY_GREENSTEIN (α = 0), RAYLEIGH (g = 0, α = 1) and DRAINE."""

    g: float
    alpha: float

    @property
    def _norm(self) -> float:
        return 1.0 + self.alpha * (1.0 + 2.0 * self.g**2) / 3.0

    @property
    def sampled(self) -> "DraineLobe":
        """The lobe that ``invert`` follows: isotropic g below a thousandth, where its integral cancels."""
        return DraineLobe(0.0, self.alpha) if abs(self.g) < _MARGIN else self

    def value(self, cosine: np.ndarray) -> np.ndarray:
        """Per steradian at ``cosine`` (n,)."""
        spread = 1.0 + self.g**2 - 2.0 * self.g * cosine
        lobe = (1.0 - self.g**2) / (4.0 * np.pi * self._norm * spread * np.sqrt(spread))
        return lobe * (1.0 + self.alpha * cosine**2)

    def moments(self, order: int) -> np.ndarray:
        """Legendre moments (order + 1,): those of Henyey-Greenstein are g^l, and cos·P_l is a sum of P_(l−1) and P_(l+1)."""
        l = np.arange(order + 3)
        plain = self.g**l if self.g else (l == 0).astype(float)
        squared = _times_cosine(_times_cosine(plain))
        return (plain[:order + 1] + self.alpha * squared[:order + 1]) / self._norm

    def cumulative(self, cosine: np.ndarray) -> np.ndarray:
        """The share (n,) that is scattered at a smaller cosine; of ``sampled`` lobes only."""
        lowest = self._antiderivative(np.float64(-1.0))
        return (self._antiderivative(cosine) - lowest) / (self._antiderivative(np.float64(1.0)) - lowest)

    def _antiderivative(self, cosine):
        g, whole = self.g, 1.0 + self.g**2
        if g == 0:
            return cosine + self.alpha * cosine**3 / 3.0
        root = np.sqrt(whole - 2.0 * g * cosine)
        bent = whole**2 / root + 2.0 * whole * root - root**3 / 3.0
        return 1.0 / (g * root) + self.alpha * bent / (4.0 * g**3)

    def invert(self, u: np.ndarray) -> np.ndarray:
        """The cosine (n,) below which the share ``u`` (n,) is scattered."""
        if self.alpha:
            return _bisect(self.cumulative, u)
        if self.g == 0:
            return 2.0 * u - 1.0
        bend = (1.0 - self.g**2) / (1.0 - self.g + 2.0 * self.g * u)
        return np.clip((1.0 + self.g**2 - bend**2) / (2.0 * self.g), -1.0, 1.0)


@dataclass(frozen=True)
class FournierForandLobe:
    """Light in the sea: particles of refraction ``ior`` whose sizes follow a power law, and throw the share ``backscatter`` back.

    δ(s) = 4s/(3(n − 1)²) with s = sin²(θ/2), and an exponent v that gives the share. The peak at θ = 0 is not finite.
    """

    ior: float
    backscatter: float

    @property
    def _scale(self) -> float:
        return 4.0 / (3.0 * (self.ior - 1.0) ** 2)

    @property
    def _exponent(self) -> float:
        across = 0.5 * self._scale
        return -np.log(2.0 * self.backscatter * (across - 1.0) + 1.0) / np.log(across)

    @property
    def _bend(self) -> float:
        return (self._scale**-self._exponent - 1.0) / (self._scale - 1.0)

    @property
    def terms(self) -> tuple[float, float, float]:
        """What ``value`` is made of: the scale of δ, the exponent v, and the factor of the bend."""
        return self._scale, self._exponent, self._bend

    @property
    def sampled(self) -> "FournierForandLobe":
        """See DraineLobe."""
        return self

    def value(self, cosine: np.ndarray) -> np.ndarray:
        """See DraineLobe."""
        half, v = np.maximum(0.5 * (1.0 - cosine), 1e-17), self._exponent
        delta = self._scale * half
        rest, power = 1.0 - delta, delta**v
        with np.errstate(divide="ignore", invalid="ignore"):
            lobe = (v * rest - (1.0 - power) + (delta * (1.0 - power) - v * rest) / half) / (4.0 * np.pi * rest**2 * power)
        # To first order in 1 − δ, where both sides of the fraction vanish.
        near = v * (v - 1.0 - (v + 1.0) / half) / (8.0 * np.pi)
        near += v * (v + 1.0) * rest * (2.0 * (v - 1.0) - (2.0 * v + 1.0) / half) / (24.0 * np.pi)
        return np.where(np.abs(rest) < 1e-4, near, lobe) + self._bend * (3.0 * cosine**2 - 1.0) / (16.0 * np.pi)

    def moments(self, order: int) -> np.ndarray:
        """See DraineLobe; from the integral of the distribution, which is finite where the value is not."""
        root, weight = np.polynomial.legendre.leggauss(200)
        # cosine = 1 − 2x⁸: the distribution's own power law at the peak becomes smooth.
        x, cosine = 0.5 * (root + 1.0), 1.0 - 2.0 * (0.5 * (root + 1.0)) ** 8
        below = self.cumulative(cosine) * (8.0 * x**7 * weight)
        slopes = [np.polynomial.legendre.Legendre.basis(l).deriv()(cosine) for l in range(order + 1)]
        return np.array([1.0 - np.sum(slope * below) for slope in slopes])

    def cumulative(self, cosine: np.ndarray) -> np.ndarray:
        """See DraineLobe."""
        half, v = np.maximum(0.5 * (1.0 - cosine), 1e-300), self._exponent
        delta = self._scale * half
        rest, power = 1.0 - delta, delta**v
        with np.errstate(divide="ignore", invalid="ignore"):
            within = (1.0 - power * delta - (1.0 - power) * half) / (rest * power)
        near = 1.0 + v * (1.0 - half) * (1.0 + 0.5 * (v + 1.0) * rest)
        within = np.where(np.abs(rest) < 1e-4, near, within)
        return 1.0 - (within + self._bend * cosine * (1.0 - cosine**2) / 8.0)

    def invert(self, u: np.ndarray) -> np.ndarray:
        """See DraineLobe."""
        return _bisect(self.cumulative, u)


class Share(NamedTuple):
    """One of the lobes that a phase function is the sum of, and its weight."""

    weight: float
    lobe: DraineLobe | FournierForandLobe


def lobes(phase: Phase) -> tuple[Share, ...]:
    """The lobes of a phase function; their weights sum to 1. Raises ValueError for a kind that is not known."""
    limit = 1.0 - _MARGIN
    g = float(np.clip(phase.anisotropy, -limit, limit))
    if phase.kind == HENYEY_GREENSTEIN:
        return (Share(1.0, DraineLobe(g, 0.0)),)
    if phase.kind == RAYLEIGH:
        return (Share(1.0, DraineLobe(0.0, 1.0)),)
    if phase.kind == DRAINE:
        return (Share(1.0, DraineLobe(g, max(float(phase.alpha), 0.0))),)
    if phase.kind == FOURNIER_FORAND:
        share = min(abs(phase.backscatter), 0.5 - _MARGIN)
        return (Share(1.0, FournierForandLobe(max(float(phase.ior), 1.0 + _MARGIN), share)),)
    if phase.kind == MIE:
        g_plain, g_bent, alpha, weight = _droplets(max(float(phase.diameter), 0.0))
        return Share(1.0 - weight, DraineLobe(g_plain, 0.0)), Share(weight, DraineLobe(g_bent, alpha))
    raise ValueError(f"unknown phase function {phase.kind}")


def phase_value(phase: Phase, cosine: np.ndarray) -> np.ndarray:
    """The phase function [1/sr] at ``cosine`` (n,) of the angle by which light turns: (n,) float64."""
    cosine = np.asarray(cosine, np.float64)
    return sum(weight * lobe.value(cosine) for weight, lobe in lobes(phase))


def phase_moments(phase: Phase, order: int) -> np.ndarray:
    """Legendre moments a_l = 2π∫p·P_l d cos, l = 0 … ``order``: (order + 1,) float64.

    a_0 is 1 and a_1 the mean cosine. Radiance in SH is scattered band by band: L_in(d) = Σ a_l·L_lm·Y_lm(d), exactly.
    """
    return sum(weight * lobe.moments(order) for weight, lobe in lobes(phase))


def sample_phase(phase: Phase, directions: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions (n, 3) float32 about ``directions`` (n, 3) from [0, 1)² (n, 2), and the density [1/sr] (n,) float64 with
    which they were drawn: that of the phase function itself, but for what DraineLobe.sampled says."""
    share, parts = np.asarray(u[:, 0], np.float64), lobes(phase)
    cosine = np.empty(len(share))
    first = 0.0
    for weight, lobe in parts:
        rows = np.flatnonzero((share >= first) & ((share < first + weight) | (lobe is parts[-1].lobe)))
        if rows.size:
            cosine[rows] = lobe.sampled.invert(np.minimum((share[rows] - first) / weight, 1.0))
        first += weight
    density = sum(weight * lobe.sampled.value(cosine) for weight, lobe in parts)
    sine, azimuth = np.sqrt(np.maximum(0.0, 1.0 - cosine**2)), 2.0 * np.pi * u[:, 1]
    local = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)
    return about(np.asarray(directions, np.float32), local.astype(np.float32)), density


def _times_cosine(moments: np.ndarray) -> np.ndarray:
    """Moments of cos·p from those of p; the last one lacks what is beyond."""
    l = np.arange(len(moments))
    above, below = np.append(moments[1:], 0.0), np.append(0.0, moments[:-1])
    return ((l + 1) * above + l * below) / (2 * l + 1)


def _bisect(cumulative, u: np.ndarray) -> np.ndarray:
    low, high = np.full(len(u), -1.0), np.full(len(u), 1.0)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = cumulative(middle) < u
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def _droplets(d: float) -> tuple[float, float, float, float]:
    """g of Henyey-Greenstein, g and α of Draine and the latter's weight for water droplets of diameter ``d`` [µm] (Jendersie and
    d'Eon 2023, eq. 4-7, and the supplement for those below 5 µm)."""
    if d <= 0.1:
        return 13.8 * d**2, 1.1456 * d * np.sin(9.29044 * d), 250.0, 0.252977 - 312.983 * d**4.3
    log = np.log(d)
    if d < 1.5:
        turn = 1.19692 * np.cos((log - 0.238604) * (log + 1.00667) / (0.507522 - 0.15677 * log)) + 1.37932 * log + 0.0625835
        return (0.862 - 0.143 * log**2, 0.379685 * np.cos(turn) + 0.344213, 250.0,
                0.146209 * np.cos(3.38707 * log + 2.11193) + 0.316072 + 0.0778917 * log)
    if d < 5.0:
        wave = np.cos(5.68947 * (np.log(log) - 0.0292149))
        return (0.0604931 * np.log(log) + 0.940256, 0.500411 - 0.081287 / (-2.0 * log + np.tan(log) + 1.27551),
                7.30354 * log + 6.31675, 0.026914 * (log - wave) + 0.3764)
    return (np.exp(-0.0990567 / (d - 1.67154)), np.exp(-2.20679 / (d + 3.91029) - 0.428934),
            np.exp(3.62489 - 8.29288 / (d + 5.52825)), np.exp(-0.599085 / (d - 0.641583) - 0.665888))
