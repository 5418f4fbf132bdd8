"""Tables of reflective shadow maps for include/irradiance_rsm.glsl, the twin of techniques/rsm/gather.py, ``gather``."""

from dataclasses import replace

import numpy as np

from ...numerics.sampling import hash_u32
from ...scene import Medium, Scene
from ...techniques.rsm.field import RsmField
from ...techniques.rsm.gather import MIN_SAMPLES, Pattern, prepare
from ...transport.lights.shadow_view import ShadowView
from ...transport.media.tracer import looked_at
from ...transport.views.reflective_shadow_map import ReflectiveShadowMap
from ..atlas import MAX_TEXTURE_SIDE
from ..media_tables import media_texels
from ..packing import fold, map_texels
from ..uniforms import UniformStruct
from .tables import Tables

STRUCT = UniformStruct("RsmMaps", (("int", "count"), ("uint", "seed_state"), ("float", "disk_radius"), ("int", "media")))
# What makes of the program the one that follows media.
IN_MEDIA = (("IN_MEDIA", "1"),)
# The widest sheet of maps: one of three texels for each of the maps' is within every GPU's limit.
_SHEET_WIDTH = MAX_TEXTURE_SIDE // 3


class Sheet:
    """Square maps of ``sizes`` [texels] on one sheet, in shelves: ``places`` are their lowest corners (x, y), ``size`` its own."""

    def __init__(self, sizes: list[int]):
        self.places: list[tuple[int, int]] = []
        x = y = shelf = width = 0
        for size in sizes:
            if x and x + size > _SHEET_WIDTH:
                x, y, shelf = 0, y + shelf, 0
            self.places.append((x, y))
            x, shelf, width = x + size, max(shelf, size), max(width, x + size)
        self.size = max(width, 1), max(y + shelf, 1)


def rsm_tables(field: RsmField, samples: int | None = None) -> Tables:
    """The maps of ``field``, sampled as it does, or with ``samples`` texels a lamp."""
    pattern = field.pattern if samples is None else replace(field.pattern, samples=samples)
    return map_tables(field.maps, pattern, least_of(samples), media_between(field.capture.context.scene))


def media_between(scene: Scene) -> tuple[Medium, ...]:
    """What takes of the light on its way from surfaces."""
    return tuple(medium for medium in scene.media if looked_at(medium))


def map_tables(maps: tuple[ReflectiveShadowMap, ...], pattern: Pattern, least: int, media: tuple[Medium, ...] = ()) -> Tables:
    """``maps``, read through ``media`` by ``pattern`` with at least so many samples of each."""
    maps = prepare(maps, pattern.samples, least)
    sheet = Sheet([item.view.resolution for item in maps])
    width, height = sheet.size
    texels, cumulative = np.zeros((height, 3 * width, 4), np.float32), np.zeros((height, width), np.float32)
    for item, (x, y) in zip(maps, sheet.places, strict=True):
        size = item.view.resolution
        texels[y:y + size, 3 * x:3 * (x + size)] = map_texels(item)
        cumulative[y:y + size, x:x + size] = item.cumulative.reshape(size, size)
    parts = [item.places(pattern) for item in maps]
    through = {}
    if media:
        placed = media_texels(media)
        through = {"media_table": placed.table, "media_cells": placed.cells}
    return Tables("indirect_rsm", STRUCT, rsm_values(len(maps), pattern, len(media)),
                  {"texels": texels, "cumulative": cumulative, "maps": map_rows([item.view for item in maps], sheet, parts),
                   "pattern": pattern_rows(parts), **through}, IN_MEDIA if media else ())


def least_of(samples: int | None) -> int:
    """The fewest samples of a map: frames that are averaged may be left with one."""
    return MIN_SAMPLES if samples is None else 1


def pattern_rows(parts: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Texels of all maps' points (``GatherMap.places``), one map after the other."""
    return fold(np.concatenate([np.zeros((0, 2), np.float32), *(points for of_map in parts for points in of_map)]))


def rsm_values(count: int, pattern: Pattern, media: int = 0) -> dict:
    """Values of STRUCT for so many maps and media."""
    return {"count": count, "media": media, "seed_state": int(hash_u32(pattern.seed)), "disk_radius": pattern.disk_radius}


def map_rows(views: list[ShadowView], sheet: Sheet, parts: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Texels of the list of maps: where each lies on the sheet, and which points of the pattern are its (``GatherMap.places``)."""
    rows, first = np.zeros((max(len(views), 1), 5, 4), np.float32), 0
    for number, (view, place, (disk, flux)) in enumerate(zip(views, sheet.places, parts, strict=True)):
        rows[number, :3] = view.clip_from_world[[0, 1, 3]]
        rows[number, 3] = view.resolution, *place, first
        rows[number, 4, :2] = len(disk), len(flux)
        first += len(disk) + len(flux)
    return fold(rows.reshape(len(rows), -1))
