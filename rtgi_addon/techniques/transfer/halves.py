"""How noisy probes of a bake of transfer are, from how far the first half of their rays is off all of them.

It is the noise of the light that was baked: what rays miss of the matrices, they miss of it. Under other light it is unknown.
"""

from dataclasses import replace

import numpy as np

from ..probes.gather import RAYS_PER_LIGHT_SAMPLE, Gatherer, Traced
from ..probes.gathering import HALVES
from ..probes.items import Item


def early_light(gatherers: list[Gatherer], item: Item, traced: Traced, texel: np.ndarray | None) -> np.ndarray | float:
    """The light (g, m, k, 3) of all ``gatherers`` as the first half of the rays of ``item`` has it, of whose blocks each is of
    other probes."""
    half = replace(item, count=early_rays(item.count))
    (g, n, m), kept = item.shape, half.count
    block, ray, probe = traced.rows // (n * m), traced.rows // m % n, traced.rows % m
    early = np.flatnonzero(ray < kept)
    rows = ((block * kept + ray) * m + probe)[early].astype(traced.rows.dtype)
    tint = None if traced.tint is None else traced.tint.reshape(g, n, m, 3)[:, :kept].reshape(-1, 3)
    found = replace(traced.take(early), rows=rows, directions=np.ascontiguousarray(
        traced.directions.reshape(g, n, 3)[:, :kept].reshape(-1, 3)), tint=tint)
    texel = None if texel is None else texel[early]
    return sum(gatherer.shade(half, found, texel).sh for gatherer in gatherers) / np.float32(kept)


def early_rays(rays: int) -> int:
    """How many of ``rays`` are the first half: whole steps of what shares a sample of a light."""
    return rays // 2 // RAYS_PER_LIGHT_SAMPLE * RAYS_PER_LIGHT_SAMPLE


def standard_error(light: np.ndarray, early: np.ndarray, rays: int) -> np.ndarray:
    """RMS error (p,) of coefficients ``light`` (p, k, 3) of ``rays``, whose first half says ``early`` (p, k, 3)."""
    first = early_rays(rays)
    # Of what the first rays and the rest differ by, light − early is the rest's share.
    between = (light - early) * (rays / (rays - first))
    shares = 4.0 * first * (rays - first) / rays**2
    return np.sqrt(HALVES * shares * np.mean(np.square(between, dtype=np.float64), axis=(1, 2)))
