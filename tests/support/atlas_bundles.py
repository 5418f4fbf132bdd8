"""Bundles with a light atlas, for exports."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from transfer_bundles import transfer_bundle, uneven_bundle

from rtgi_addon.effects.atlas.matrices import NUMBERS, AtlasTransfer
from rtgi_addon.effects.atlas.sheet import LightAtlas
from rtgi_addon.effects.atlas.unwrapped import Part, Sheet
from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.exchange.engines.transfer_conformance import kit_transfer


def light_atlas():
    """A sheet of noise with a floor and a wall, of which the wall's map is the mesh's second."""
    rng = np.random.default_rng(8)
    coefficients = (rng.normal(size=(24, 32, 4, 3)) * 0.2).astype(np.float32)
    coefficients[:, :, 0] += 2.0
    parts = (Part("Floor.001", 0, "UVMap", 0, 0, 0, 20, 24, 15.0, np.array([2.0, 2.5])),
             Part("Wall", 1, "Lightmap", 1, 20, 0, 12, 12, 8.0, np.array([22.0, 2.0])))
    known = rng.random((24, 32)) < 0.8
    return LightAtlas(Sheet(parts, (24, 32)), coefficients, np.abs(coefficients[:, :, 0]) * 0.9, known)


def relit_atlas_bundle(uneven=False):
    """The kit's probes with their transfer, and a light atlas that knows it too; of lights that are ``uneven``, some texels get
    10,000 times as much as others."""
    transfer, rng, sheet = kit_transfer(), np.random.default_rng(9), light_atlas()
    size = (*sheet.sheet.size, NUMBERS)

    def matrices(*shape):
        return (0.3 * rng.random(shape) - 0.1).astype(np.float32)

    of_texels = AtlasTransfer(2, 4, False, matrices(*size, 9), matrices(3, *size, 9), matrices(3, *size, 16), matrices(*size, 16),
                              matrices(3, *size, len(transfer.lights)))
    if uneven:
        brighter = 10.0 ** rng.uniform(0.0, 4.0, (*size[:2], 1, 1)).astype(np.float32)
        of_texels = replace(of_texels, lights=of_texels.lights * brighter)
    return replace(uneven_bundle() if uneven else transfer_bundle(), atlas=replace(sheet, transfer=of_texels))


def atlas_bundle():
    """The kit's probes with a light atlas beside them."""
    return replace(Bundle(Path("kit"), {"scene": "kit", "includes_direct": False}, kit_field().grids()), atlas=light_atlas())
