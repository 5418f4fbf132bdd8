"""What gathers a picture's indirect light: a bake, or rays of every pixel, the exact mode, which ends at an error of its own."""

from collections.abc import Iterable

from .base import Chosen, in_order
from .ray_traced import EFFECT as RAY_TRACED

GATHERS = ("bake", "rays")
# The error that a picture by rays is to have, as a root mean square relative to its mean, and the most samples of a pixel.
ERROR, MOST_SAMPLES = 0.02, 16384


def by_rays(chosen: Iterable[Chosen]) -> tuple[Chosen, ...]:
    """``chosen`` effects with ray-traced light: at its defaults where it is not among them."""
    chosen = tuple(chosen)
    own = () if any(entry.effect.name == RAY_TRACED.name for entry in chosen) else (Chosen(RAY_TRACED, RAY_TRACED.Settings()),)
    return in_order((*chosen, *own))


def reached_text(reached: float, wanted: float, samples: float) -> str:
    """What a picture by rays came to, as a phrase."""
    missed = "" if reached <= wanted else f", {100 * wanted:.3g} % was asked for: allow more samples"
    return f"{100 * reached:.2g} % off by its noise{missed}, {samples:.0f} samples a pixel"
