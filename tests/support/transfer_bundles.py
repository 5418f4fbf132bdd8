"""Bundles with transfer, for tests of exports."""

from functools import cache
from pathlib import Path

from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines.transfer_conformance import kit_transfer
from rtgi_addon.techniques.transfer.field import TransferField


class TransferBundle(Bundle):
    """The conformance kit with its transfer, as if it had been read from a disk."""

    @property
    def transfer_field(self):
        return TransferField(kit_transfer())


@cache
def transfer_bundle():
    return TransferBundle(Path("kit"), {"scene": "kit", "includes_direct": False, "transfer": {}},
                          tuple(grid.grid for grid in kit_transfer().grids))
