"""The radiosity system B = ρ(E + F·B) on a sparse F of equally weighted hits, by accelerated fixed-point iteration."""

import numpy as np

from ... import kernels
from ...progress import Progress
from ..parallel import parallel_for
from .form_factors import FormFactors
from .texel_rows import TexelRows

# Anderson's memory: past steps combined into the next. More gains nothing on systems this well conditioned.
_MEMORY = 4
MAX_ITERATIONS = 2000
# Iterations that usually do: what the progress bar goes by.
_USUAL_ITERATIONS = 16
# Share of the mixing's normal equations that is added to their diagonal: steps may be almost the same.
_REGULARISED = 1e-10


def solve_radiosity(form_factors: FormFactors, source: np.ndarray, first_bounce: np.ndarray, rows: TexelRows,
                    by_angle: np.ndarray, bounces: int | None, tolerance: float, threads: int | None, progress: Progress,
                    known: np.ndarray | None = None, start: np.ndarray | None = None) -> np.ndarray:
    """Irradiance (n + 1, 3) that texels receive from one another.

    ``source`` (n + 1, 3) is the irradiance from elsewhere that is reflected in here; ``first_bounce`` (n + 1, 3) is what texels
    receive of light that was reflected once already; the last row of each is zero. ``by_angle`` (m, 3) are the factors that the
    form factors' ``angles`` index, if they have any. The fixed point is received = first_bounce + F·ρ(source + received), where ρ
    of ``rows`` reflects, and passes on what their other sides receive. With ``bounces`` the series is cut after ``bounces`` − 1
    passes; None iterates until the largest relative change falls below ``tolerance``, with Anderson's extrapolation
    (Walker and Ni 2011, "Anderson acceleration for fixed-point iterations"), which changes the path, not the limit. ``known``
    (k, 3) is what the first texels received in an earlier solution with fewer of them, which stands (None, and wherever bounces
    are counted: all are solved): what a texel sees was brought into use with it, so none of them sees a later one. ``start``
    (n + 1, 3) is what they are thought to receive, where bounces are not counted: the nearer, the fewer passes (None: the first
    bounce).
    """
    fixed = 0 if known is None or bounces is not None else len(known)
    spans = form_factors.spans()
    blocks = [number for number, span in enumerate(spans) if span.stop > fixed]
    reflect = (rows.albedo[fixed:] / np.float32(np.pi)).astype(np.float32)
    passing = rows.passing[rows.passing >= fixed]
    pass_on, opposite = rows.translucency[passing] / np.float32(np.pi), rows.opposite[passing, 0]
    passes = MAX_ITERATIONS if bounces is None else max(0, bounces - 1)
    received = first_bounce.copy() if passes else np.zeros_like(source)
    # Rows of four floats: numpy copies 16-byte rows with a single instruction.
    radiance = np.zeros((len(source), 4), np.float32)

    def gather(k):
        i = blocks[k]
        if form_factors.is_plain and kernels.is_available():
            received[spans[i]] = form_factors.spread(i, radiance, first_bounce[spans[i]])
            return
        incoming, span = form_factors.seen(i, radiance, by_angle), spans[i]
        mean = incoming.sum(axis=0)[:, :3] * np.float32(np.pi / form_factors.rays)
        received[span] = first_bounce[span] + mean

    def leaving(irradiance):
        result = reflect * irradiance[fixed:]
        if passing.size:
            result[passing - fixed] += pass_on * irradiance[opposite]
        return result

    def apply():
        parallel_for(gather, len(blocks), threads)
        irradiance[fixed:] = source[fixed:] + received[fixed:]
        return leaving(irradiance)

    if start is not None and bounces is None:
        received[:] = start
    if fixed:
        received[:fixed] = known
    # Starting from the first bounce saves a pass where all are wanted; a counted series starts from nothing.
    irradiance = source + received if bounces is None else source.copy()
    radiance[:, :3] = rows.leaving(irradiance) / np.float32(np.pi)
    of_known = float(np.abs(radiance[:fixed, :3]).sum(dtype=np.float64))
    current = leaving(irradiance)
    history = Anderson()
    for iteration in range(passes):
        radiance[fixed:, :3] = current
        following = apply()
        change = float(np.abs(following - current).max(initial=0.0))
        scale = (of_known + float(np.abs(following).sum(dtype=np.float64))) / len(source)
        progress.step(min(iteration / _USUAL_ITERATIONS, 0.99), "light between surfaces")
        if bounces is None and change <= tolerance * scale:
            break
        current = following if bounces is not None else history.step(current, following)
    return received


class Anderson:
    """Type-II Anderson mixing, each column on its own; of light that may be negative if ``signed``, as that of a function is that
    others are made of."""

    def __init__(self, signed: bool = False):
        self._residuals, self._images, self._last, self._signed = [], [], None, signed

    def step(self, point: np.ndarray, image: np.ndarray) -> np.ndarray:
        """The next point (n, c) after ``point``, which the iteration takes to ``image``."""
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
        gram[:, diagonal, diagonal] += _REGULARISED * np.trace(gram, axis1=1, axis2=2)[:, None] + 1e-300
        weights = np.linalg.solve(gram, np.einsum("cin,cn->ci", steps, residual)[:, :, None])[:, :, 0]
        result = (image_rows - np.einsum("ci,cin->cn", weights, images)).T
        if self._signed:
            return result.astype(np.float32)
        # A negative radiance can only come from extrapolating too far: such entries keep the plain step.
        return np.where(result >= 0, result, image).astype(np.float32)
