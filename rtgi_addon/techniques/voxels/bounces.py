"""What lit voxels then send each other, bounce by bounce, and what all further bounces add.

So many bounces are swept through the voxels themselves. What is left is smooth: it is swept on through voxels twice as large, which
cost an eighth, until each bounce is like the last. Only then do all others follow in proportion. A proportion of the first bounces
would be one for all places, whereas a room that a sun lights through a window keeps most of its light and the street in front of it
next to none.
"""

import numpy as np

from ...numerics.sampling import fibonacci_sphere
from ...progress import Progress
from ...transport.context import LightContext
from ...transport.voxels import Voxels
from ...transport.voxels.sweeps import sample_cells
from .lighting import SWEEPS, VoxelLight
from .settings import SURFACES, VoxelSettings

# How far a lighting is when lamps are done, and what of that is theirs where there is a cache to solve.
_LAMPS = 0.3
# Further bounces that are swept, and what they take of the time of one bounce.
FURTHER, _TIME = 6, 0.75


def light_voxels(context: LightContext, cascades: tuple[Voxels, ...], settings: VoxelSettings, seed: int, beyond,
                 progress: Progress) -> list[np.ndarray]:
    """Radiance (e, 3) float32 that leaves what the faces of the voxels of each of nested grids show, by point of ``Voxels.seen``;
    ``beyond``(directions (k, 3)) is that (k, 3) of what lies outside them all. Raises Cancelled, BakeError."""
    parts, direct = [VoxelLight(context, voxels, settings, seed) for voxels in cascades], []
    shares = [progress.span(index / len(parts), (index + 1) / len(parts)) for index in range(len(parts))]
    if settings.light == SURFACES:
        return [part.direct(share.span(0.0, _LAMPS)) + part.cached(share.span(_LAMPS, 1.0))
                for part, share in zip(parts, shares, strict=True)]
    for index, part in enumerate(parts):
        direct.append(part.direct(progress.span(_LAMPS * index / len(parts), _LAMPS * (index + 1) / len(parts))))
    return bounced(parts, settings, direct, beyond, progress.span(_LAMPS, 1.0))


def bounced(parts: list[VoxelLight], settings: VoxelSettings, direct: list[np.ndarray], beyond,
            progress: Progress) -> list[np.ndarray]:
    """What leaves (e, 3) of ``direct`` (e, 3), of what lies ``beyond``(directions (k, 3)) → (k, 3), and of what voxels then send
    each other, grid by grid of nested ones, finest first. Raises Cancelled."""
    steps = [beyond] if np.any(beyond(fibonacci_sphere(SWEEPS))) else []
    steps += [_nothing] * settings.bounces
    more = settings.further_bounces and settings.bounces > 0
    cost = 1.0 / max(len(steps) + _TIME * more, 1.0)
    # Unlit voxels hide the sky from each other; then each reflects what the last one sent on.
    total, arrived = direct, None
    last = direct if len(steps) == settings.bounces else [np.zeros_like(light) for light in direct]
    for number, outside in enumerate(steps):
        found, around = [], None
        # From the outermost in: what comes through the border of a grid has come through the next.
        for index in reversed(range(len(parts))):
            done = number + (len(parts) - 1 - index) / len(parts)
            part, inflow = parts[index], None if around is None else _through_border(parts[index], *around)
            light = part.swept(last[index], outside, progress.span(cost * done, cost * (done + 1 / len(parts))), inflow)
            found.insert(0, part.reflected(part, light))
            around = part, light
            # The outermost grid knows all that the light meets.
            arrived = light if index == len(parts) - 1 else arrived
        if outside is beyond:
            total = last = [light + new for light, new in zip(direct, found, strict=True)]
            continue
        total, last = [light + new for light, new in zip(total, found, strict=True)], found
    if more:
        coarse, rest = _still_to_come(parts[-1], arrived, progress.span(cost * len(steps), 1.0))
        total = [light + part.reflected(coarse, rest) for light, part in zip(total, parts, strict=True)]
    return total


def _through_border(part: VoxelLight, outer: VoxelLight, light: np.ndarray) -> np.ndarray:
    """What arrives (nz, ny, nx, 9, 3) in the cells at the border of ``part`` of the ``light`` that does in those of the grid around
    it."""
    grid = part.grid
    inflow, outermost = np.zeros((*grid.shape, *light.shape[3:]), np.float32), np.ones(grid.shape, bool)
    outermost[1:-1, 1:-1, 1:-1] = False
    border = np.flatnonzero(outermost)
    inflow.reshape(grid.count, *inflow.shape[3:])[border] = sample_cells(outer.grid, light, grid.centers_of(border))
    return inflow


def _still_to_come(part: VoxelLight, arrived: np.ndarray, progress: Progress) -> tuple[VoxelLight, np.ndarray]:
    """What all bounces after the last make arrive (nz, ny, nx, 9, 3), of which ``arrived`` in the cells of ``part``, and in whose
    cells that is."""
    coarse = part.coarser()
    last, total = coarse.reflected(part, arrived), None
    for number in range(FURTHER):
        light = coarse.swept(last, _nothing, progress.span(number / FURTHER, (number + 1) / FURTHER))
        before, last = last, coarse.reflected(coarse, light)
        total = light if total is None else total + light
    kept = coarse.kept(before, light, last)
    return coarse, total + light * (kept / (1.0 - kept)).astype(np.float32)


def _nothing(directions: np.ndarray) -> np.ndarray:
    """Radiance (k, 3) of what lies outside for light that stays within."""
    return np.zeros((len(directions), 3), np.float32)
