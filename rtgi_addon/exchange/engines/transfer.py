"""A bundle's transfer made ready for an engine: for every probe a table of what it makes of each light, a column each.

A column is the probe's nine coefficients under one light of strength 1: a light of the file as it was baked, a harmonic of the sky,
or a sun's direction, for which it also says how much of that sun the probe sees. An engine multiplies columns by what light there
is, adds them up and derings the sum (`relight.glsl`), which is the arithmetic of `rtgi relight` (techniques/transfer/relight.py).
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import sh
from ...techniques.transfer.data import Transfer, TransferGrid
from ...techniques.transfer.lighting import Lighting, Sky
from ...techniques.transfer.relight import light_factors, sun_shares
from ..bundle import Bundle
from .axes import Axes
from .volumes import ORDER, export_order

COEFFICIENTS = sh.coefficient_count(ORDER)
# Nine coefficients of three colours, and what is seen of a sun: seven texels of four numbers.
NUMBERS, TEXELS = 28, 7
# The largest number of a column as it is stored. Godot's importer reads halves below 2^-14 as 0: of columns whose largest is 1 that
# would lose what a lamp beside one probe gives to those far from it.
_LARGEST = 2.0**15


@dataclass(frozen=True, eq=False)
class EngineTransfer:
    """Tables along an engine's axes: ``tables`` (C, p, 28) float16 of each volume, in the order of ``export_volumes``, red, green
    and blue of each coefficient in turn, then how much of a sun is seen. Column c is all stored over ``scales`` (C,). Columns are
    ``lights`` ((name, kind) each), then ``sky_count`` harmonics of the sky, then the suns of a dome of ``sun_side`` nodes a side
    (numerics/dome.py, in Blender's axes), twice as many with ``sun_below``. ``source`` is what they were made of."""

    source: Transfer
    tables: tuple[np.ndarray, ...]
    scales: np.ndarray
    lights: tuple[tuple[str, str], ...]
    sky_count: int
    sun_side: int
    sun_below: bool

    @property
    def first_sun(self) -> int:
        """The first column of a sun."""
        return len(self.lights) + self.sky_count

    def to_json(self) -> dict:
        """What a loader has to know besides the tables."""
        return {"lights": [{"name": name, "kind": kind} for name, kind in self.lights], "sky": self.sky_count,
                "sunSide": self.sun_side, "sunBelow": self.sun_below, "scales": [float(f"{value:.9g}") for value in self.scales]}


def engine_transfer(bundle: Bundle, axes: Axes) -> EngineTransfer | None:
    """The transfer of ``bundle`` along ``axes``; None where it has none. Raises BakeError for files that are damaged."""
    return tables_of(bundle.transfer_field.transfer, axes) if bundle.manifest.get("transfer") is not None else None


def tables_of(transfer: Transfer, axes: Axes) -> EngineTransfer:
    """The tables of ``transfer`` along ``axes``."""
    columns = [_columns(transfer.grids[index], axes) for index in export_order([grid.grid.volume for grid in transfer.grids])]
    scales = half_scales(np.max([np.abs(part).max(axis=(1, 2), initial=0.0) for part in columns], axis=0))
    tables = tuple(_table(part, scales) for part in columns)
    return EngineTransfer(transfer, tables, scales, transfer.lights, sh.coefficient_count(transfer.sky_order), transfer.sun_side,
                          transfer.sun_below)


def half_scales(largest: np.ndarray) -> np.ndarray:
    """What (C,) float32 to store columns over as halves whose ``largest`` magnitudes (C,) are known."""
    return np.where(largest > 0.0, largest / _LARGEST, 1.0).astype(np.float32)


def notes_on_transfer(transfer: EngineTransfer | None) -> list[str]:
    """What a person should know of ``transfer`` in an engine."""
    if transfer is None:
        return []
    size = sum(table.nbytes for table in transfer.tables)
    notes = [f"relighting takes {size / 2**20:.1f} MiB of tables, {transfer.tables[0][:, 0].nbytes / 1000:.1f} kB a probe"]
    if 0 < transfer.source.sun_vectors < len(transfer.source.sun_directions):
        notes.append(f"suns are by {transfer.source.sun_vectors} vectors in the bundle, and by direction in the export")
    sites = len(transfer.source.sites)
    if sites:
        notes.append("lamps that the bake does not know are not followed in engines: the responses at "
                     f"{sites} lamp sites are left out")
    return notes


def engine_sky(sky: Sky, axes: Axes) -> dict:
    """``sky`` as a loader takes it: harmonics along the engine's axes, and what they leave as irradiances of the dome's suns."""
    return {"harmonics": axes.harmonics(sky.coefficients).tolist(), "suns": np.asarray(sky.suns, np.float64).tolist()}


def weights(transfer: Transfer, lighting: Lighting, sky: Sky | None) -> np.ndarray:
    """What (C, 3) ``lighting`` multiplies each column by; of a sky, what is seen of its suns comes on top."""
    count = sh.coefficient_count(transfer.sky_order)
    harmonics = np.zeros((count, 3)) if sky is None else np.asarray(sky.coefficients, np.float64)
    return np.concatenate([light_factors(transfer, lighting), harmonics, sun_shares(transfer, lighting, sky)])


def _columns(grid: TransferGrid, axes: Axes) -> np.ndarray:
    """(C, p, 28) float32 of one volume."""
    sky = grid.bounce + grid.sky[None]
    turned = axes.harmonics(np.eye(sky.shape[5])[:, :, None])[..., 0]
    sky = sky @ turned
    parts = [_coefficients(part, axes) for part in (grid.lights, sky, grid.suns)]
    columns = np.concatenate(parts)
    seen = np.zeros(columns.shape[:2], np.float32)
    seen[len(columns) - grid.seen.shape[3]:] = grid.seen.reshape(-1, grid.seen.shape[3]).T
    return np.concatenate([columns, seen[:, :, None]], axis=2)


def _coefficients(matrices: np.ndarray, axes: Axes) -> np.ndarray:
    """(C, p, 27) of ``matrices`` (3, nz, ny, nx, k, C)."""
    kept = min(matrices.shape[4], COEFFICIENTS)
    columns = np.zeros((matrices.shape[5], int(np.prod(matrices.shape[1:4])), COEFFICIENTS, 3), np.float32)
    columns[:, :, :kept] = matrices[..., :kept, :].reshape(3, columns.shape[1], kept, -1).transpose(3, 1, 2, 0)
    return axes.harmonics(columns).reshape(*columns.shape[:2], -1)


def _table(columns: np.ndarray, scales: np.ndarray) -> np.ndarray:
    return (columns / scales[:, None, None]).astype(np.float16)
