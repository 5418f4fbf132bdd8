"""Media for Godot: textures, their index, the shader that marches them, and what Godot's own volumetric fog makes of them.

Godot's fog (servers/rendering/renderer_rd/shaders/environment/volumetric_fog*.glsl) has one density and one g a place, and fog
volumes in fixed point: density in steps of 1/1024, scattering up to 1 in steps of 1/1023, emission up to 4 in steps of 1/255.
"""

import json
from pathlib import Path

import numpy as np

from ...exr import write_exr
from ...flipbook import layout, to_sheet
from ..base import write_text
from ..halves import half_scale, over
from ..media import EngineMedia
from ..media_shader import media_functions, media_shader
from ..media_textures import ambient_blocks, cell_blocks
from .textures import import_record, require_size

INDEX, FOLDER = "media.json", "media"
# What goes into a project beside what is written here.
FILES = ("media.gd", "fog.gd", "media.tscn", "fog_volume.gdshader", "media_view.gdshader")
# The largest scattering [1/m] and emission [W/(sr m^3)] that a fog volume holds.
_MOST_SCATTERING, _MOST_EMISSION = 1.0, 4.0
# What of g and of colour is told apart.
_SAME = 0.02

_SAMPLER = "uniform sampler3D {name} : filter_linear, repeat_disable;"


def write_media(folder: Path, media: EngineMedia) -> None:
    """Write all that depends on ``media`` into ``folder``. Raises BakeError for what no 3D texture holds, OSError."""
    nz, ny, nx = media.ambient.shape[:3]
    ambient = f"{FOLDER}/ambient.exr"
    light = ambient_blocks(media)
    scale = half_scale(light)
    write_slices(folder / ambient, over(light, scale), "the ambient light of the media")
    boxes = []
    for box in media.boxes:
        name = f"{FOLDER}/{box.folder}.exr"
        cells = cell_blocks(box)
        held = half_scale(cells)
        write_slices(folder / name, over(cells, held), f"medium {box.name!r}")
        boxes.append({"name": box.name, "cells": name, "scale": held, "resolution": list(box.resolution),
                      "blocks": len(box.cells), "unit_from_local": _rows(box.unit_from_world),
                      "scattering": box.scattering.tolist(), "absorption": box.absorption.tolist(),
                      "emission": box.emission.tolist(), "moments": box.moments.tolist()})
    index = {"everywhere": media.fills_space, "extinction": media.extinction.tolist(), "emission": media.emission.tolist(),
             "scattering": media.scattering.tolist(), "anisotropy": anisotropy(media),
             "ambient": {"cells": ambient, "scale": scale, "resolution": [nx, ny, nz],
                         "unit_from_local": _rows(media.ambient_from_world)},
             "boxes": boxes}
    write_text(folder / INDEX, json.dumps(index, indent=1) + "\n")
    write_text(folder / "media_functions.gdshaderinc", media_functions(scale))
    write_text(folder / "media.gdshaderinc", media_shader(media, _SAMPLER, functions='#include "media_functions.gdshaderinc"\n'))


def anisotropy(media: EngineMedia) -> float:
    """The one g that Godot's fog has for lamps: the mean of the media's first moments, by what they scatter."""
    weights = [media.scattering[0].sum(), *(box.scattering.sum() for box in media.boxes)]
    values = [media.scattering[1].sum() / max(weights[0], 1e-30), *(box.moments[0] for box in media.boxes)]
    return float(np.average(values, weights=weights)) if sum(weights) > 0 else 0.0


def notes_on_media(media: EngineMedia | None) -> list[str]:
    """What Godot does not hold of ``media``, and what it costs; first what no engine does."""
    if media is None:
        return []
    notes, g = list(media.notes), anisotropy(media)
    scattering = [("the world's fog", media.scattering[0], media.scattering[1].sum() / max(media.scattering[0].sum(), 1e-30)),
                  *((f"medium {box.name}", box.scattering, box.moments[0]) for box in media.boxes)]
    odd = [f"{name} of g = {own:.2f}" for name, part, own in scattering if part.sum() > 0 and abs(own - g) > _SAME]
    if odd:
        notes.append(f"Godot's fog has one g for the lamps' light, {g:.2f}: that of {', '.join(odd)} is lost")
    for name, extinction in [("the world's fog", media.extinction),
                             *((f"medium {box.name}", box.scattering + box.absorption) for box in media.boxes)]:
        if np.ptp(extinction) > _SAME * extinction.max(initial=0.0):
            notes.append(f"Godot's fog dims all colours alike, in {name} by {extinction.mean():.3g} a metre "
                         f"instead of {', '.join(f'{value:.3g}' for value in extinction)}")
    for box in media.boxes:
        if box.scattering.max() > _MOST_SCATTERING or box.emission.max() > _MOST_EMISSION:
            notes.append(f"medium {box.name}: Godot's fog volumes scatter {_MOST_SCATTERING:g} a metre and give "
                         f"{_MOST_EMISSION:g} W/(sr m^3) at most, and this one does {box.scattering.max():.3g} and "
                         f"{box.emission.max():.3g}; media_view.gdshader holds it")
    if np.any(media.emission > 0) and not np.any(media.extinction > 0):
        notes.append("Godot's fog gives light only where it is dense: the world's is given a density of 0.0001 a metre")
    return notes


def write_slices(path: Path, slices: np.ndarray, what: str) -> None:
    """Write ``slices`` (depth, height, width, channels) as a flipbook that Godot imports as a 3D texture; ``what`` names it."""
    depth, height, width, channels = slices.shape
    require_size(slices.shape[:3], what)
    tiles = layout((width, height, depth))
    sheet = to_sheet(slices, tiles)
    path.parent.mkdir(parents=True, exist_ok=True)
    letters = "R" if channels == 1 else "RGBA"
    write_exr(path, {letter: sheet[..., index] for index, letter in enumerate(letters)}, {"media": what})
    write_text(path.with_name(path.name + ".import"), import_record(tiles))


def _rows(matrix: np.ndarray) -> list[list[float]]:
    return matrix[:3].tolist()
