"""Bundles with transfer, for tests of exports."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines.transfer_conformance import kit_transfer
from rtgi_addon.techniques.lattice.dilation import dilate
from rtgi_addon.techniques.transfer.field import TransferField


class TransferBundle(Bundle):
    """The conformance kit with its transfer, as if it had been read from a disk."""

    @property
    def transfer_field(self):
        return TransferField(kit_transfer())


class UnevenBundle(TransferBundle):
    """The same with `uneven_transfer`."""

    @property
    def transfer_field(self):
        return TransferField(uneven_transfer())


@cache
def uneven_transfer():
    """The kit's transfer with lights that are beside some probes, which get up to 10,000 times as much, and far from others."""
    rng, transfer = np.random.default_rng(4), kit_transfer()

    def unevenly(grid):
        lights = grid.lights * 10.0 ** rng.uniform(0.0, 4.0, (*grid.lights.shape[1:4], 1, 1))
        flat = np.moveaxis(lights, 0, -1)
        filled = dilate(replace(grid.grid, sh=flat.reshape(*flat.shape[:4], -1).astype(np.float32))).sh.reshape(flat.shape)
        return replace(grid, lights=np.ascontiguousarray(np.moveaxis(filled, -1, 0)))

    return replace(transfer, grids=tuple(unevenly(grid) for grid in transfer.grids))


@cache
def transfer_bundle():
    return _bundle(TransferBundle)


@cache
def uneven_bundle():
    return _bundle(UnevenBundle)


def _bundle(kind):
    return kind(Path("kit"), {"scene": "kit", "includes_direct": False, "transfer": {}},
                tuple(grid.grid for grid in kit_transfer().grids))
