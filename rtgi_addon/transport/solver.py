"""The radiosity system B = ρ(E + F·B) on a sparse F of equally weighted hits, by accelerated fixed-point iteration."""

import numpy as np

from ..progress import Progress
from .parallel import parallel_for

# Anderson's memory: past steps combined into the next. More gains nothing on systems this well conditioned.
_MEMORY = 4
MAX_ITERATIONS = 2000


def solve_radiosity(form_factors: list[np.ndarray], source: np.ndarray, first_bounce: np.ndarray, albedo: np.ndarray,
                    bounces: int | None, tolerance: float, threads: int | None, progress: Progress) -> np.ndarray:
    """Irradiance (n + 1, 3) that texels receive from one another.

    ``form_factors`` holds (R, nᵢ) int32 blocks of hit texels (−1: none) for consecutive texels; ``source`` (n + 1, 3) is the
    irradiance from elsewhere that is reflected in here; ``first_bounce`` (n + 1, 3) is what texels receive of light that was
    reflected once already; ``albedo`` (n + 1, 3); the last row of each is zero. The fixed point is
    received = first_bounce + F·ρ(source + received). With ``bounces`` the series is cut after ``bounces`` − 1
    passes; None iterates until the largest relative change falls below ``tolerance``, with Anderson's extrapolation
    (Walker and Ni 2011, "Anderson acceleration for fixed-point iterations"), which changes the path, not the limit.
    """
    starts = np.concatenate(([0], np.cumsum([block.shape[1] for block in form_factors], dtype=np.int64)))
    reflect = (albedo / np.float32(np.pi)).astype(np.float32)
    passes = MAX_ITERATIONS if bounces is None else max(0, bounces - 1)
    received = first_bounce.copy() if passes else np.zeros_like(source)
    # Rows of four floats: numpy copies 16-byte rows with a single instruction.
    radiance = np.zeros((len(source), 4), np.float32)

    def gather(i):
        block = form_factors[i]
        hits = np.take(radiance, block, axis=0, mode="wrap")
        mean = hits.sum(axis=0)[:, :3] * np.float32(np.pi / block.shape[0])
        span = slice(starts[i], starts[i + 1])
        received[span] = first_bounce[span] + mean

    def apply():
        parallel_for(gather, len(form_factors), threads)
        return reflect * (source + received)

    # Starting from the first bounce saves a pass where all are wanted; a counted series starts from nothing.
    current = reflect * (source + received) if bounces is None else reflect * source
    history = _Anderson()
    for iteration in range(passes):
        radiance[:, :3] = current
        following = apply()
        change = float(np.abs(following - current).max(initial=0.0))
        scale = float(np.abs(following).mean(dtype=np.float64)) * 3.0
        progress.step(min(iteration / 16, 0.99), "light between surfaces")
        if bounces is None and change <= tolerance * scale:
            break
        current = following if bounces is not None else history.step(current, following)
    return received


class _Anderson:
    """Type-II Anderson mixing, each colour channel on its own."""

    def __init__(self):
        self._residuals, self._images, self._last = [], [], None

    def step(self, point: np.ndarray, image: np.ndarray) -> np.ndarray:
        # Channel by channel in memory, for contiguous rows; products by einsum, since BLAS would start threads for so few rows.
        image_rows = np.ascontiguousarray(image.T, np.float64)
        residual = image_rows - point.T
        last, self._last = self._last, (residual, image_rows)
        if last is None:
            return image
        self._residuals = [*self._residuals[1 - _MEMORY:], residual - last[0]]
        self._images = [*self._images[1 - _MEMORY:], image_rows - last[1]]
        steps, images = np.stack(self._residuals, axis=1), np.stack(self._images, axis=1)
        gram = np.einsum("cin,cjn->cij", steps, steps)
        diagonal = np.arange(gram.shape[1])
        gram[:, diagonal, diagonal] += 1e-10 * np.trace(gram, axis1=1, axis2=2)[:, None] + 1e-300
        weights = np.linalg.solve(gram, np.einsum("cin,cn->ci", steps, residual)[:, :, None])[:, :, 0]
        result = (image_rows - np.einsum("ci,cin->cn", weights, images)).T
        # A negative radiance can only come from extrapolating too far: such entries keep the plain step.
        return np.where(result >= 0, result, image).astype(np.float32)
