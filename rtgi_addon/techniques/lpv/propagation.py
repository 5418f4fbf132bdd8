"""Light from cell to cell: every step takes each cell's intensity through its six faces into the neighbours.

Kaplanyan and Dachsbacher 2010 send on what goes through a neighbour's face as a lobe towards each of that cell's own faces. Four
fifths of it go aside, so light forgets its direction within a cell: it spreads as in a fog whose mean free path is one cell, and
the finer the cells, the more of it comes back to the surface that it left. Here a face passes the light with the vector flux that
it has (the half-range moments of its SH, `grid`), so its direction is kept but for what ``direction_kept`` says. With a cell's
flux P and vector flux F, s = +1 or -1 along axis k, a the other axes and T what the face lets through,

    P' += T·(P/6 + s·F_k/3),   F'_k += T·k·(s·P/9 + 2·F_k/9),   F'_a += T·k·5·F_a/36

What a surface stops of M = P/6 + s·F_k/3 it reflects by its albedo, as a lobe about its normal, from the cell that the light came
from. Slanted surfaces stand on the faces as stairs, whose area is |n|_1 = |n_x| + |n_y| + |n_z| times theirs: as much of P/6 as
that area is too much (the vector flux through stairs is that through the slope) stays in the cell, without direction. Nothing is
clamped: each step is linear, all of a closed room's light is met by its walls, at any resolution.

The sum over the steps is multiplied by the ratio of the stairs' area to the surface's own about each cell (``Blocking.area``): a
wall stands on the nearest face, so a room of cells is larger or smaller than the room, and its light thinner or denser.

All arrays are flat, so that a neighbour is a constant shift and every operand contiguous; light that would leave the volume has
transmittance 0. Where media are, both P' and F' are multiplied by what these leave in the cell (`media_cells`).
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ...progress import Progress
from ...transport.parallel import thread_count
from .geometry_volume import Blocking
from .grid import FLUX_OUT, LINEAR, LOBE_VECTOR, PER_FLUX, PER_VECTOR, VECTOR_ACROSS, VECTOR_AHEAD, VECTOR_OF_FLUX, VECTOR_OUT

# Cells per unit of work: its temporaries stay in the second-level cache.
CHUNK_CELLS = 16384


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
    if blocking.area is not None:
        total *= blocking.area
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
                    step_light = target[:, :, start:stop]
                    total[:, :, start:stop] += step_light if blocking.area is None else step_light * blocking.area[start:stop]

            list(pool.map(advance, range(workers)))
            current, following = following, current
    total /= scale
    return total.reshape(shape)


def _advance(source: np.ndarray, target: np.ndarray, blocking: Blocking, start: int, stop: int) -> None:
    """One step for the cells from ``start`` to ``stop``: writes ``target`` (4, 3, N) there from all of ``source`` (4, 3, N)."""
    count, kept = source.shape[2], blocking.direction
    result = np.zeros((4, 3, stop - start), np.float32)
    product = np.empty((3, stop - start), np.float32)
    for axis, stride in enumerate(blocking.strides):
        row, *others = (LINEAR[(axis + turn) % 3] for turn in range(3))
        low, high = max(start - stride, 0), min(stop + stride, count)
        flux, vector = source[0, :, low:high], source[row, :, low:high]
        flux_out, vector_out = flux * np.float32(FLUX_OUT), vector * np.float32(VECTOR_OUT)
        flux_ahead, vector_ahead = flux * np.float32(kept * VECTOR_OF_FLUX), vector * np.float32(kept * VECTOR_AHEAD)
        for sign in (1, -1):
            if blocking.reflectance is not None:
                own = slice(start - low, stop - low)
                outward = flux_out[:, own], vector_out[:, own]
                _reflect(result, product, *outward, blocking, axis, sign, row, others, slice(start, stop))
            shift = stride if sign > 0 else -stride
            begin, end = max(start - shift, 0), min(stop - shift, count)
            if end <= begin:
                continue
            into = slice(begin + shift - start, end + shift - start)
            sent = slice(begin - low, end - low)
            # A face belongs to the cell below it.
            through = blocking.through[axis, begin:end] if sign > 0 else blocking.through[axis, begin - stride:end - stride]
            out, buffer = result[:, :, into], product[:, :end - begin]
            (np.add if sign > 0 else np.subtract)(flux_out[:, sent], vector_out[:, sent], out=buffer)
            buffer *= through
            out[0] += buffer
            (np.add if sign > 0 else np.subtract)(vector_ahead[:, sent], flux_ahead[:, sent], out=buffer)
            buffer *= through
            out[row] += buffer
            across = through * np.float32(kept * VECTOR_ACROSS)
            for other in others:
                np.multiply(source[other, :, begin:end], across, out=buffer)
                out[other] += buffer
    if blocking.kept is not None:
        result[0] *= blocking.kept[0, :, start:stop]
        result[1:] *= blocking.kept[1, :, start:stop]
    target[:, :, start:stop] = result


def _reflect(result, product, flux_out, vector_out, blocking, axis, sign, row, others, here) -> None:
    """Add to ``result`` what the blockers at one face of each of the cells ``here`` send back of what met them."""
    end = 0 if sign > 0 else 1
    closed, share = blocking.blocked[axis, end][:, here]
    # What meets the surface, and what only its stairs.
    met = flux_out * share
    spare = flux_out - met
    (np.add if sign > 0 else np.subtract)(met, vector_out, out=met)
    met *= blocking.reflectance[axis, end][:, here]
    met *= closed
    spare *= closed
    result[0] += spare
    result[0] += met
    met *= np.float32(LOBE_VECTOR)
    normal = blocking.normal[axis, end]
    for index, linear in enumerate((row, *others)):
        np.multiply(met, normal[index, here], out=product)
        (np.subtract if sign > 0 else np.add)(result[linear], product, out=result[linear])
