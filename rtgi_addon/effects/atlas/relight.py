"""A light atlas under other light, from what its texels make of any (matrices.py): sums of products, and no ray."""

from dataclasses import replace

import numpy as np

from ...scene import Scene
from ...techniques.base import Field
from ...techniques.transfer.data import Transfer
from ...techniques.transfer.follow import lighting_in
from ...techniques.transfer.lighting import Lighting, sky_of
from ...techniques.transfer.relight import light_factors, sun_shares
from .matrices import LEAST_SIDE
from .sheet import LightAtlas, light_atlas

STALE_ATLAS = "the light atlas holds other light than is shown: its surfaces show the field's until the next bake"


def relit_atlas(atlas: LightAtlas, transfer: Transfer, lighting: Lighting) -> LightAtlas | None:
    """``atlas`` under other light, None where it does not know what its texels make of any; ``transfer`` is that of the probes
    beside it. New lamps add nothing, nor do suns where none are followed. Raises UsageError for a group that does not exist."""
    own = atlas.transfer
    if own is None:
        return None
    columns = replace(transfer, sky_order=own.sky_order, sun_side=max(own.sun_side, LEAST_SIDE), sun_below=own.sun_below)
    sky = None if lighting.world is None else sky_of(lighting.world, columns)
    light = np.einsum("chwng,gc->hwnc", own.lights, light_factors(transfer, lighting).astype(np.float32))
    if sky is not None:
        light += own.sky @ sky.coefficients
        light += np.einsum("chwns,sc->hwnc", own.bounce, sky.coefficients)
    if own.follows_suns:
        light += np.einsum("chwnk,kc->hwnc", own.suns, sun_shares(columns, lighting, sky).astype(np.float32))
        if sky is not None:
            light += own.seen @ sky.suns
    height, width = atlas.sheet.size
    return light_atlas(atlas.sheet, light.reshape(height, width, -1), atlas.known)


def with_atlas(lit: Field, baked: Field, scene: Scene) -> Field:
    """``lit``, which is ``baked`` relit for ``scene``, with the light atlas of ``baked`` under the same light, none where texels
    do not follow it. Raises BakeError as the transfer's own relighting."""
    atlas = baked.atlas
    if atlas is not None and atlas.transfer is not None and baked.transfer is not None:
        lighting = lighting_in(baked.transfer, scene)
        if atlas.transfer.follows(lighting):
            lit.atlas = relit_atlas(atlas, baked.transfer, lighting)
    return lit


def is_left_out(lit: Field | None, baked: Field | None) -> bool:
    """Whether ``lit``, which is ``baked`` or its light under other lamps, goes without the light atlas that ``baked`` has."""
    return lit is not None and baked is not None and lit is not baked and lit.atlas is None and baked.atlas is not None
