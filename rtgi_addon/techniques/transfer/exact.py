"""Suns by rays: what surfaces reflect of the suns of a scene, at the probes of a transfer, where the scene itself is at hand.

The table of directions is off by some per cent of the bounce between its directions (docs/techniques/transfer.md). The same rays as
in the bake, from the same probes, with the suns as they stand as the only light, are not: it is their column of a bake.
"""

from dataclasses import fields, replace

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ...scene.baked import baked_part
from ...transport.context import LightContext
from .bake import TransferBake
from .columns import SUNS, LightColumn, dark_context, is_loose_sun
from .data import Transfer
from .settings import TransferSettings

# Columns that no sun asks for: the fewest that a bake takes.
_LEAST = {"sites": 0, "sun_side": 3, "sky_order": 0, "sun_below": False}


def exact_suns(transfer: Transfer, settings: dict, scene: Scene, progress: Progress,
               threads: int | None = None) -> list[np.ndarray]:
    """SH (nz, ny, nx, k, 3) float32 of what comes of the suns of ``scene`` that are in no light group, at the probes of each grid
    of ``transfer``, which was baked of its surfaces with ``settings`` (name → value). Raises BakeError, Cancelled."""
    suns = tuple(light for light in baked_part(scene).lights if is_loose_sun(light) and np.any(light.strength > 0))
    shapes = [(*grid.shape, grid.coefficients, 3) for grid in transfer.grids]
    if not suns:
        return [np.zeros(shape, np.float32) for shape in shapes]
    progress.step(0.0, "Following the sun by rays")
    known = {item.name for item in fields(TransferSettings)}
    own = TransferSettings(**{name: value for name, value in settings.items() if name in known} | _LEAST)
    dark = dark_context(scene, threads)
    column = LightColumn(SUNS, SUNS, LightContext(replace(dark.scene, lights=suns), threads, same_surfaces=dark))
    grids = TransferBake(dark, [column], tuple(grid.grid.volume for grid in transfer.grids), own, 0, progress).run()
    return [np.moveaxis(grid.lights[..., 0], 0, -1) for grid in grids]
