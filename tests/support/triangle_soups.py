"""Random triangles, rays through them, and what it means that two tracers agree."""

import numpy as np
import scene_builders as build


def soup(triangles=300, seed=0, scale=1.0):
    """A scene of random triangles that cut through one another."""
    rng = np.random.default_rng(seed)
    centres = rng.uniform(-1, 1, (triangles, 1, 3))
    corners = (centres + rng.normal(scale=0.25, size=(triangles, 3, 3))) * scale
    return build.scene([build.mesh("soup", corners.reshape(-1, 3), np.arange(3 * triangles).reshape(-1, 3))])


def rays(n, seed=1, scale=1.0):
    """Origins and directions (n, 3) in and around the soup, of many lengths."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(n, 3)) * rng.uniform(0.2, 3.0, (n, 1))
    return rng.uniform(-2, 2, (n, 3)).astype(np.float32) * np.float32(scale), directions.astype(np.float32)


def assert_same_hits(hits, oracle, scale=1.0):
    """The same triangle and distance; where two triangles meet at one distance, either will do, and no ray falls through."""
    assert np.array_equal(hits.primitive >= 0, oracle.primitive >= 0)
    found = oracle.primitive >= 0
    np.testing.assert_allclose(hits.t[found], oracle.t[found], rtol=2e-5, atol=2e-6 * scale)
    assert np.all(np.isinf(hits.t[~found])) and np.all(hits.primitive[~found] == -1)
    same = hits.primitive[found] == oracle.primitive[found]
    assert same.mean() > 0.999
    for name in ("u", "v"):
        np.testing.assert_allclose(getattr(hits, name)[found][same], getattr(oracle, name)[found][same], atol=2e-3)
