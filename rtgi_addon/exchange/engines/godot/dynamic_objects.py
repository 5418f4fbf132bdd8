"""What the LightmapGIData of the kit must show on a white dynamic object: radiance E / pi at points for normals along the axes."""

import numpy as np

from ....numerics import sh
from ..volumes import ORDER, ExportVolume
from .light_data import light_data

# Few enough to be drawn at once.
_SAMPLES = 24
# Godot draws into half floats and blends in float32; of the brightest point, what is left of that beside it.
_TOLERANCE, _LEAST = 2e-3, 1e-5


def dynamic_case(volumes: tuple[ExportVolume, ...]) -> dict:
    """JSON-able ``points``, ``normals``, ``radiance`` and ``tolerance``: at probes of every volume and between them."""
    rng = np.random.default_rng(5)
    points = []
    for number in range(_SAMPLES):
        volume = volumes[number % len(volumes)]
        high = np.array(volume.nodes) - 1.0
        lattice = rng.uniform(0.0, high) if number % 2 else rng.integers(0, high + 1).astype(float)
        matrix = volume.offset_from_lattice
        points.append(matrix[:3, :3] @ lattice + matrix[:3, 3] + volume.centre)
    points = np.array(points, np.float32)
    normals = np.concatenate([np.eye(3), -np.eye(3)])[rng.integers(0, 6, _SAMPLES)].astype(np.float32)
    tapped = light_data(volumes).tap(points)
    weights = sh.evaluate(normals, ORDER) * sh.cosine_coefficients(ORDER)
    radiance = np.maximum(np.einsum("nk,nkc->nc", weights, tapped), 0.0)
    tolerance = _TOLERANCE * np.einsum("nk,nkc->nc", np.abs(weights), np.abs(tapped)) + _LEAST * radiance.max()
    return {"points": points.tolist(), "normals": normals.tolist(), "radiance": radiance.tolist(), "tolerance": tolerance.tolist()}
