"""The bake of a light atlas: cosine-distributed rays from the surface under every texel, whose ends read the surface cache (a final
gather, as pictures by rays have it behind pixels), onto the texel's coefficients.

A texel is lit from all of the surface that it covers, at up to FINENESS² places. Places inside solids, under a wall that stands on
a floor, do not count, and texels without any other are filled from their neighbours. Light is that on the fronts of faces.
"""

from dataclasses import dataclass, fields

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene, baked_part
from ...scene.scene import DYNAMIC
from ...techniques.base import Field
from ...transport.context import LightContext
from ...transport.surfaces.geometry import flatten
from .borders import Borders
from .gather import TexelGather
from .islands import bleeding
from .settings import AtlasSettings
from .sheet import LightAtlas, light_atlas
from .transfer import bake_transfer
from .unwrapped import Places, Sheet, lay_out, places_of

# A note is made of texels that stay dark where this share of an object's has no place in the open.
_TOLD = 0.5
# And of an object that reads other islands' texels on more than this share of its surface.
_BLEEDS = 0.01


@dataclass(frozen=True, eq=False)
class BakedAtlas:
    """The finished ``atlas`` (None: nothing is in one), ``notes`` for the user and the number of ``rays``."""

    atlas: LightAtlas | None
    notes: tuple[str, ...]
    rays: int


def wants_atlas(scene: Scene) -> bool:
    """Whether light of anything in ``scene`` is to be in an atlas."""
    return any(instance.atlas is not None for instance in scene.instances)


def require_atlas(scene: Scene, settings: AtlasSettings) -> None:
    """Raise BakeError, with the object's name, where the atlas of ``scene`` cannot be baked: before any ray."""
    if not wants_atlas(scene):
        return
    _require_static(scene)
    scene = baked_part(scene)
    geometry = flatten(scene)
    sheet = lay_out(scene, geometry, settings)
    for part in sheet.parts:
        places_of(part, sheet, scene, geometry)


def bake_atlas(scene: Scene, field: Field | None, settings: AtlasSettings, seed: int = 0, threads: int | None = None,
               progress: Progress | None = None) -> BakedAtlas:
    """Bake the light of the objects of ``scene`` that are in the atlas; ``field`` is its indirect light elsewhere, and says of
    which lamps the direct light is held. The same for any number of ``threads``. Raises BakeError naming the object for a UV map
    that will not do, and Cancelled."""
    progress = progress or Progress()
    if not wants_atlas(scene):
        return BakedAtlas(None, (), 0)
    _require_static(scene)
    context = LightContext(scene, threads)
    sheet = lay_out(context.scene, context.geometry, settings)
    places = [places_of(part, sheet, context.scene, context.geometry) for part in sheet.parts]
    every = Places(*(np.concatenate([getattr(found, item.name) for found in places]) for item in fields(Places)))
    borders = Borders(sheet, context.scene)
    near = _near(sheet, context, places)
    if field is not None and field.transfer is not None:
        baked = bake_transfer(scene, field, settings, every, borders, seed, threads, progress)
        return BakedAtlas(baked.atlas, (*_notes(sheet, baked.texels, baked.known), *near), baked.rays)
    baking = TexelGather(context, field, settings, every, seed)
    texels, known, light = baking.run(progress.span(0.0, 0.95))
    progress.step(0.95, "Joining the seams of the light atlas")
    image, found = borders.closed(texels, known, light, baking.covered)
    return BakedAtlas(light_atlas(sheet, image, found), (*_notes(sheet, texels, known), *near), baking.rays)


def _require_static(scene: Scene) -> None:
    moving = next((item.name for item in scene.instances if item.atlas is not None and item.bake == DYNAMIC), None)
    if moving is not None:
        raise BakeError(f"{moving} is Dynamic, and the light atlas is for what stays",
                        "take it out of the atlas, or make it Static")


def _notes(sheet: Sheet, texels: np.ndarray, known: np.ndarray) -> tuple[str, ...]:
    row, column = np.divmod(texels, sheet.size[1])
    notes = []
    for part in sheet.parts:
        own = (row >= part.y) & (row < part.y + part.height) & (column >= part.x) & (column < part.x + part.width)
        if own.any() and known[own].mean() < _TOLD:
            notes.append(f"{part.name} faces the inside of something in {100 * (1 - known[own].mean()):.0f} % of its texels, and "
                         "the light atlas is that of the fronts of faces: turn its normals (Mesh > Normals > Flip)")
    return tuple(notes)


def _near(sheet: Sheet, context: LightContext, places: list[Places]) -> tuple[str, ...]:
    notes = []
    for part, found in zip(sheet.parts, places, strict=True):
        share = bleeding(part, sheet, context.scene, context.geometry, found)
        if share > _BLEEDS:
            notes.append(f"{part.name} reads light of other islands of its UV map {part.uv_map} on {100 * share:.0f} % of its "
                         "surface: unwrap it with islands two texels apart, or raise the light atlas's Density")
    return tuple(notes)
