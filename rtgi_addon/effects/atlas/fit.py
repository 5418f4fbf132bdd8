"""What texels must hold so that what is read between them is right: not the light that was measured over each texel, of which the
look-up makes another mean, but what gives this mean again.

Where an island is a texel or two wide, as the reveal of a window is, means alone flatten what changes across it, since texels
beyond its border can only repeat them. So with a the means over what each texel covers of its island, and M the look-up's mean over
the same, x minimizes |M·x − a|² + cost·|x − x₀|², x₀ being the means with the border filled: a fit of what is seen, as L. Kavan,
A. Bargteil and P.-P. Sloan have it for vertices ("Least Squares Vertex Baking", EGSR 2011). It is linear in the light.
"""

import numpy as np

from .unwrapped import FINENESS

# What the change of a texel, measured or filled in, costs against a difference from what was measured: enough that noise is not
# sharpened. Chosen on three samples (docs/atlas.md, Accuracy).
MEASURED_COST, FILLED_COST = 1.0, 0.01
_STEPS, _ENOUGH = 40, 1e-3
_AROUND = [(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1)]


class LookUpMeans:
    """M: the look-up's mean over those parts of texels that were measured: of the ``texels`` (n,) of a sheet of ``size`` (height,
    width) the places that are ``covered`` (n, FINENESS²) bool."""

    def __init__(self, size: tuple[int, int], texels: np.ndarray, covered: np.ndarray):
        weights = covered.astype(np.float32) @ _weights() / np.maximum(covered.sum(axis=1), 1)[:, None]
        self._weights = np.zeros((len(_AROUND), size[0] * size[1]), np.float32)
        self._weights[:, texels] = weights.T
        self._weights = self._weights.reshape(len(_AROUND), *size, 1)

    def of(self, image: np.ndarray) -> np.ndarray:
        """The means (height, width, c) over what is covered of ``image`` (height, width, c), 0 where nothing is."""
        padded, total = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge"), np.zeros_like(image)
        for weights, part in zip(self._weights, _parts(image.shape), strict=True):
            total += weights * padded[part]
        return total

    def back(self, image: np.ndarray) -> np.ndarray:
        """The transpose of ``of``; the sheet's edge, beyond which nothing is covered, apart."""
        padded = np.zeros((image.shape[0] + 2, image.shape[1] + 2, image.shape[2]), image.dtype)
        for weights, part in zip(self._weights, _parts(image.shape), strict=True):
            padded[part] += weights * image
        return padded[1:-1, 1:-1]


def fitted(image: np.ndarray, means: LookUpMeans, known: np.ndarray) -> np.ndarray:
    """``image`` (height, width, c) of what was measured at texels ``known`` (height, width) bool, and filled in elsewhere, changed
    so that what is read between texels is that."""
    cost = np.where(known, MEASURED_COST, FILLED_COST).astype(image.dtype)[..., None]

    def applied(change: np.ndarray) -> np.ndarray:
        return means.back(means.of(change)) + cost * change

    # Conjugate gradients of all channels at once.
    change, rest = np.zeros_like(image), means.back(np.where(known[..., None], image - means.of(image), 0.0))
    along, power = rest.copy(), _power(rest)
    enough = _ENOUGH**2 * np.maximum(power, 1e-30)
    for _ in range(_STEPS):
        if np.all(power <= enough):
            break
        moved = applied(along)
        step = (power / np.maximum(np.einsum("hwc,hwc->c", along, moved, dtype=np.float64), 1e-30)).astype(image.dtype)
        change += step * along
        rest -= step * moved
        following = _power(rest)
        along, power = rest + (following / np.maximum(power, 1e-30)).astype(image.dtype) * along, following
    return image + change


def _power(image: np.ndarray) -> np.ndarray:
    return np.einsum("hwc,hwc->c", image, image, dtype=np.float64)


def _parts(shape: tuple[int, ...]) -> list[tuple[slice, slice]]:
    """Of an image padded by one all around, the part that lies one step off in each of _AROUND."""
    return [(slice(1 + row, 1 + row + shape[0]), slice(1 + column, 1 + column + shape[1])) for row, column in _AROUND]


def _weights() -> np.ndarray:
    """(FINENESS², 9) float32: what the look-up at each place of a texel takes of the texels in _AROUND."""
    off = (np.arange(FINENESS) + 0.5) / FINENESS - 0.5
    along = np.stack([np.maximum(-off, 0.0), 1.0 - np.abs(off), np.maximum(off, 0.0)], axis=1)
    return np.einsum("ya,xb->yxab", along, along).reshape(FINENESS**2, len(_AROUND)).astype(np.float32)
