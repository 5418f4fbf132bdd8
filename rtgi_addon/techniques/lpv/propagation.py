"""Light from cell to cell: every step takes each cell's intensity through its six faces into the neighbours.

Kaplanyan and Dachsbacher 2010: through the face f of a neighbour, seen from a cell's centre under the solid angle
W_f in direction w_f, goes the flux W_f·I(w_f)·(1 - B(w_f)); the neighbour sends it on as a cosine lobe towards f. What is
blocked is reflected by the blocker's albedo, as a lobe about its normal, from the cell that it came from.

Intensities are never clamped. An SH of order 1 sends -13.8 % of a cosine lobe backwards; clamping that away would add as much
light at every step. Backward light that meets a blocker comes back whole, so a lobe in front of a wall sends out just its
flux, and a closed box takes in exactly what its lights give.

In terms of a cell's flux P and vector flux J (`grid`), with s = +1 or -1 along axis k and a, b the other axes, the six 4x4
matrices of `grid.step_matrices` come down to

    P' += t + w,   J'_k += s·t,   J'_a += T_a·J_a,   J'_b += T_b·J_b,   t = T_0·(P + 2s·J_k),   w = T_w·(P + 2s·c·J_k)

where c is the cosine between a side face and the way ahead, and T holds solid angles and transmittances. All arrays are flat, so
that a neighbour is a constant shift and every operand contiguous; light that would leave the volume has transmittance 0.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...progress import Progress
from ...transport.parallel import thread_count
from .geometry_volume import Blocking
from .grid import LINEAR, PER_FLUX, PER_VECTOR, SIDE_AHEAD

# Cells per unit of work: its temporaries stay in the second-level cache.
CHUNK_CELLS = 16384
_AHEAD = np.float32(SIDE_AHEAD)


def propagate(coefficients: np.ndarray, blocking: Blocking, steps: int, *, threads: int | None = None,
              progress: Progress | None = None) -> np.ndarray:
    """The accumulated volume (4, 3, nz, ny, nx) float32: injected ``coefficients`` of that shape and what each of ``steps`` steps
    makes of them, summed.

    ``blocking`` says what the faces between cells let through and reflect (`geometry_volume.face_blocking`). The result is the
    same for any number of ``threads``. Raises Cancelled when asked to stop.
    """
    shape = coefficients.shape
    current = coefficients.reshape(4, 3, -1).astype(np.float32, copy=True)
    scale = np.full((4, 1, 1), 1.0 / PER_VECTOR, np.float32)
    scale[0] = 1.0 / PER_FLUX
    current *= scale
    total, following = current.copy(), np.empty_like(current)
    count = current.shape[2]
    spans = [(start, min(start + CHUNK_CELLS, count)) for start in range(0, count, CHUNK_CELLS)]
    workers = min(thread_count(threads), len(spans))
    with ThreadPoolExecutor(workers) as pool:
        for step in range(steps):
            if progress is not None:
                progress.step(step / steps, "propagating light")

            def advance(worker, source=current, target=following):
                for start, stop in spans[worker::workers]:
                    _advance(source, target, blocking, start, stop)
                    total[:, :, start:stop] += target[:, :, start:stop]

            list(pool.map(advance, range(workers)))
            current, following = following, current
    total /= scale
    return total.reshape(shape)


def _advance(source: np.ndarray, target: np.ndarray, blocking: Blocking, start: int, stop: int) -> None:
    """One step for the cells from ``start`` to ``stop``: writes ``target`` (4, 3, N) there from all of ``source`` (4, 3, N)."""
    count = source.shape[2]
    result = np.zeros((4, 3, stop - start), np.float32)
    product = np.empty((3, stop - start), np.float32)
    for axis, stride in enumerate(blocking.strides):
        row, *others = (LINEAR[(axis + turn) % 3] for turn in range(3))
        low, high = max(start - stride, 0), min(stop + stride, count)
        flux = source[0, :, low:high]
        twice = source[row, :, low:high] * np.float32(2.0)
        ahead = twice * _AHEAD
        for sign in (1, -1):
            # From `first` to `last` lie the cells whose light arrives here, and behind them or before them those that reflect.
            first, last = (low, stop) if sign > 0 else (start, high)
            part = slice(first - low, last - low)
            combine = np.add if sign > 0 else np.subtract
            front, side = combine(flux[:, part], twice[:, part]), combine(flux[:, part], ahead[:, part])
            if blocking.reflectance is not None:
                _reflect(result, product, front, side, blocking, axis, sign, row, others, (start, stop, first))
            shift = stride if sign > 0 else -stride
            begin, end = max(start - shift, 0), min(stop - shift, count)
            if end <= begin:
                continue
            into = slice(begin + shift - start, end + shift - start)
            sent = slice(begin - first, end - first)
            # A face belongs to the cell below it.
            face = slice(begin, end) if sign > 0 else slice(begin - stride, end - stride)
            through = blocking.through[axis][:, face]
            out, buffer = result[:, :, into], product[:, :end - begin]
            np.multiply(front[:, sent], through[0], out=buffer)
            out[0] += buffer
            combine(out[row], buffer, out=out[row])
            np.multiply(side[:, sent], through[1], out=buffer)
            out[0] += buffer
            for index, other in enumerate(others):
                np.multiply(source[other, :, begin:end], through[2 + index], out=buffer)
                out[other] += buffer
    target[:, :, start:stop] = result


def _reflect(result, product, front, side, blocking, axis, sign, row, others, span) -> None:
    """Add to ``result`` what the blockers at one face of each cell send back of what met them."""
    start, stop, first = span
    own = slice(start - first, stop - first)
    here = slice(start, stop)
    table = blocking.blocked[axis, 0 if sign > 0 else 1]
    back = front[:, own] * table[0, here]
    np.multiply(side[:, own], table[1, here], out=product)
    back += product
    # Light cannot be negative: the back of a lobe is returned whole, whatever the albedo.
    backward = np.minimum(back, np.float32(0.0))
    back -= backward
    back *= blocking.reflectance[axis, 0 if sign > 0 else 1][:, here]
    back += backward
    result[0] += back
    normal = blocking.normal[axis, 0 if sign > 0 else 1]
    for index, linear in enumerate((row, *others)):
        np.multiply(back, normal[index, here], out=product)
        if sign > 0:
            result[linear] -= product
        else:
            result[linear] += product
