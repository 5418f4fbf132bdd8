"""How much a probe counts at a point on a surface: pure functions of places and distances, which all readers of probes share.

shaders/include/probe_weights.glsl is their twin for every host of GLSL, and gets CONSTANTS from here; the readers that engines
need in languages of their own (exchange/engines: GDScript, JavaScript, three's node language) hold the same numbers under the same
names.

Two normals matter. The *surface normal*, smooth where the mesh is shaded smooth but without bumps, says on which side of the
surface a probe is and from where the point must be seen. The *normal* that is shaded, bumps and normal maps included, belongs to
the cosine of irradiance alone: bumps do not move the wall. Measured (benchmarks/README.md): with the shaded normal in place of the
surface's, light leaks thirty times as much through a wall whose bumps are steep; with the triangle's own, light steps at its edges.

Source: Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019, and NVIDIA's
RTXGI-DDGI SDK, Irradiance.hlsl (DDGIGetVolumeIrradiance, which has both normals, and takes the shaded one for the side).
"""

import numpy as np

from ...scene.scattered import SHARES, WORD

# What a probe right behind a surface still counts.
SIDE_FLOOR = 0.2
# Weights below this are crushed to w³ over its square.
CRUSH_BELOW = 0.2
# What every live probe counts more, in shares of its trilinear weight; and every probe, for points that have no live one. Close to
# the corner between a wall and the floor the probe that sees a point is itself hardly sure of it (its texel there sees both), and
# crushed to 1e-5: what counts more than that lets the one behind the wall speak as loud.
UNSEEN_FLOOR, DILATED_FLOOR = 1e-6, 1e-12
# The eight neighbours are those about a point lifted off its surface by this share of the bias, a twenty-fifth of a cell: enough
# for a surface that lies on a plane of probes to read the layer in front of it, and too little to matter in the open.
LIFT = 0.2
# Below this share of the bias a point has no direction from its probe.
AT_PROBE = 1e-6
TINY = float(np.finfo(np.float32).tiny)

# By the names that every reader has them under; WORD and SHARES are those of scattered probes (scene/scattered.py). The last four
# are the cosine lobe's bands times the basis' constants, A_l·K_lm (Ramamoorthi and Hanrahan 2001): of 1; of x, y and z; of xy, yz,
# xz and twice x² − y²; of 3z² − 1.
CONSTANTS = {
    "SIDE_FLOOR": SIDE_FLOOR, "CRUSH_BELOW": CRUSH_BELOW, "UNSEEN_FLOOR": UNSEEN_FLOOR, "DILATED_FLOOR": DILATED_FLOOR,
    "LIFT": LIFT, "AT_PROBE": AT_PROBE, "TINY": TINY, "WORD": float(WORD), "SHARES": float(SHARES),
    "COSINE_0": np.sqrt(np.pi) / 2.0, "COSINE_1": np.sqrt(np.pi / 3.0),
    "COSINE_2": np.sqrt(15.0 * np.pi) / 8.0, "COSINE_2_ZONAL": np.sqrt(5.0 * np.pi) / 16.0,
}


def shader_constants() -> dict[str, str]:
    """CONSTANTS as probe_weights.glsl names them, in nine digits, which bring a float32 back."""
    return {f"RTGI_{name}": f"{value:.9g}" for name, value in CONSTANTS.items()}


def seen_share(distance: np.ndarray, mean: np.ndarray, mean_square: np.ndarray) -> np.ndarray:
    """How surely a probe sees a point at ``distance`` r from it, in whose direction it saw ``mean`` and ``mean_square`` [m, m²]:
    the square of the share of what it saw that lies beyond r, ½(1 − (r − μ)/√(σ² + (r − μ)²)).

    The share is that of Student's t distribution of two degrees of freedom and scale σ/√2. DDGI takes Chebyshev's bound there,
    (σ²/(σ² + (r − μ)²))³, which is an upper bound and says 1 of everything nearer than the mean. But where half of what a texel saw
    lies near and half far, the mean lies behind the near half: so probes above a block shone over its edge onto the face that they
    do not see, down to a line as ragged as the tile's texels are coarse.
    """
    behind = distance - mean
    variance = np.abs(mean_square - mean * mean)
    share = 0.5 - 0.5 * behind / np.sqrt(np.maximum(variance + behind * behind, TINY))
    return share * share


def side_weight(towards_probe: np.ndarray, surface_normals: np.ndarray) -> np.ndarray:
    """((n·d + 1)/2)² + 0.2 for the way ``towards_probe`` (…, 3): probes behind the surface count little, a probe at the point
    itself in full."""
    length = np.linalg.norm(towards_probe, axis=-1)
    cosine = np.sum(towards_probe * surface_normals, axis=-1) / np.maximum(length, TINY)
    wrapped = 0.5 * (np.where(length > 0.0, cosine, 1.0) + 1.0)
    return wrapped * wrapped + SIDE_FLOOR


def probe_weight(trilinear: np.ndarray, seen: np.ndarray, live: np.ndarray) -> np.ndarray:
    """A probe's weight, not yet divided by the sum over all eight: ``trilinear`` by how much it can know, ``seen``, the product of
    ``side_weight`` and ``seen_share``; ``live`` (bool) says that it holds light of its own."""
    crushed = np.where(seen < CRUSH_BELOW, seen**3 / CRUSH_BELOW**2, seen)
    return trilinear * (np.where(live, crushed + UNSEEN_FLOOR, 0.0) + DILATED_FLOOR)


def coverage(points_lattice: np.ndarray, resolution) -> np.ndarray:
    """(n,) float32 for lattice coordinates (n, 3): 1 inside the volume, falling to 0 over its outermost cell, 0 outside."""
    count = np.asarray(resolution, np.float64)
    depth = np.minimum(points_lattice + 0.5, count - 0.5 - points_lattice) / np.minimum(count / 2.0, 1.0)
    return np.clip(depth.min(axis=-1), 0.0, 1.0).astype(np.float32)
