"""Transfer for Godot: tables as 3D textures, their index, and the shader that relights probes with them.

A column of a table is as large as the volume, seven texels wide for each probe; columns lie below each other, then behind.
"""

import json
from pathlib import Path

import numpy as np

from ...exr import write_exr
from ...flipbook import layout, to_sheet
from ..base import write_text
from ..glsl import relight_glsl, shared_glsl
from ..transfer import TEXELS, EngineTransfer
from ..volumes import ExportVolume
from .textures import IMPORT, MAX_SIDE, import_record, require_size

INDEX, TABLE, SHADER = "transfer.json", "transfer.exr", "relight.gdshader"
# What goes into a project beside what is written here.
FILES = ("relight.gd", "relight.tscn", "relit.gd")
_FILES = Path(__file__).parent / "files"


def write_transfer(folder: Path, transfer: EngineTransfer, volumes: tuple[ExportVolume, ...]) -> None:
    """Write the tables of ``transfer``, of which ``volumes`` are the probes, and their index into ``folder``. Raises BakeError for
    a table that no 3D texture holds, OSError."""
    entries = []
    for volume, table in zip(volumes, transfer.tables, strict=True):
        name = f"{volume.folder}/{TABLE}"
        down = _write_table(folder / name, volume, table)
        entries.append({"name": volume.name, "table": name, "down": down})
    write_text(folder / INDEX, json.dumps({**transfer.to_json(), "volumes": entries}, indent=1) + "\n")


def write_relight_shader(folder: Path) -> None:
    """The shader that relights probes, for the folder that goes into a project."""
    text = (_FILES / "rtgi" / f"{SHADER}.in").read_text(encoding="utf-8")
    write_text(folder / SHADER, text.replace("@SHARED@", shared_glsl()).replace("@RELIT@", relight_glsl()))


def _write_table(path: Path, volume: ExportVolume, table: np.ndarray) -> int:
    """Write ``table`` (C, p, 28) float16, and return how many columns lie below each other."""
    nx, ny, nz = volume.resolution
    down = -(-len(table) // max(1, MAX_SIDE // nz))
    behind = -(-len(table) // down)
    what = f"the transfer of volume {volume.name!r}"
    require_size((behind * nz, down * ny, TEXELS * nx), what)
    slices = np.zeros((behind, down, nz, ny, nx * TEXELS, 4), np.float16)
    slices.reshape(behind * down, -1)[:len(table)] = table.reshape(len(table), -1)
    slices = np.ascontiguousarray(slices.transpose(0, 2, 1, 3, 4, 5)).reshape(behind * nz, down * ny, nx * TEXELS, 4)
    tiles = layout((nx * TEXELS, down * ny, behind * nz))
    sheet = to_sheet(slices, tiles)
    write_exr(path, {letter: sheet[..., index] for index, letter in enumerate("RGBA")}, {"transfer": volume.name})
    write_text(path.with_name(path.name + IMPORT), import_record(tiles))
    return down
