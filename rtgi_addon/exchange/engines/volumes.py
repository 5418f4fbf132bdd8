"""A bundle made ready for an engine's shader: what our own lookup reads, along the engine's axes.

The lookup (`techniques/lattice/lookup.py`) needs what a shader cannot make at run time: probes inside geometry filled from their
neighbours, coefficients deringed as much as each probe needs, tiles with a border. That is done here once, so that an engine's
irradiance equals ours but for the rounding of its textures.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...errors import BakeError
from ...numerics import grid as lattice
from ...numerics import sh
from ...scene.scattered import named
from ...techniques import ProbeGrid
from ...techniques.lattice.field import ProbeField
from ...techniques.lattice.lookup import GridLookup
from ..bundle import Bundle
from ..names import folder_names
from .axes import Axes

# What engines' formats and shaders hold: nine coefficients.
ORDER = 2
HALF_MAX = 65504.0
# What a user should know of how coarsely places are held: more than this share of the spacing.
COARSE = 0.05


@dataclass(frozen=True, eq=False)
class ExportVolume:
    """One volume, arrays indexed [z, y, x] as in the bundle; lattice axes stay the volume's own.

    ``folder`` is a name that every file system takes. ``world_from_local`` (4, 4) float64, ``centre`` (3,) float64 and ``bias`` are
    in the engine's axes and units. ``sh`` (nz, ny, nx, 9, 3) float32: radiance, deringed and dilated, engine axes. ``offset``
    (nz, ny, nx, 3) float32: from lattice point to probe, engine axes and units. ``live`` (nz, ny, nx) bool: probes that hold
    light. ``moments`` (nz, ny, nx, T + 2, T + 2, 2) float32: mean and mean squared distance in engine units, tiles of the bundle's
    octahedral map with a border.

    Probes of a scattered volume are a list of that ``resolution``, ``offset`` is their way from the centre, and ``words``
    (nz, ny, nx, SLOTS) float32 are what the ``nodes`` (x, y, z) name (scene/scattered.py); of a lattice they are its probes, and
    ``words`` None.
    """

    name: str
    folder: str
    resolution: tuple[int, int, int]
    world_from_local: np.ndarray
    centre: np.ndarray
    bias: float
    sh: np.ndarray
    offset: np.ndarray
    live: np.ndarray
    moments: np.ndarray
    nodes: tuple[int, int, int]
    words: np.ndarray | None = None

    @property
    def tile(self) -> int:
        """Texels T along a side of a tile, without its border."""
        return self.moments.shape[3] - 2

    @property
    def lattice_from_offset(self) -> np.ndarray:
        """(4, 4) float64: lattice coordinates (node i at i) of points given from the volume's centre."""
        half = 0.5 * np.asarray(self.nodes, np.float64)
        matrix = np.eye(4)
        matrix[:3, :3] = half[:, None] * np.linalg.inv(self.world_from_local[:3, :3])
        matrix[:3, 3] = half - 0.5
        return matrix

    @property
    def offset_from_lattice(self) -> np.ndarray:
        """(4, 4) float64: points from the volume's centre of lattice coordinates."""
        return np.linalg.inv(self.lattice_from_offset)

    @property
    def on_nodes(self) -> "ExportVolume":
        """A lattice with the light that its nodes have by their shares, whatever of it a point sees."""
        if self.words is None:
            return self
        probes, shares = named(self.words.astype(np.int64))
        light = np.einsum("zyxs,zyxskc->zyxkc", shares, self.sh.reshape(-1, *self.sh.shape[3:])[probes])
        shape = self.words.shape[:3]
        return replace(self, resolution=self.nodes, words=None, sh=light.astype(np.float32),
                       offset=np.zeros((*shape, 3), np.float32), live=np.ones(shape, bool))


def engine_field(bundle: Bundle) -> ProbeField:
    """The bundle's light as engines hold it: bands above the second left out, missing ones zero, probes' places in half floats."""
    return held_field(bundle.grids, bundle.field.direct_lamps)


def held_field(grids, direct_lamps=frozenset()) -> ProbeField:
    """The same of ``grids``."""
    return ProbeField(tuple(_as_held(grid) for grid in grids), direct_lamps=direct_lamps)


def notes_on_places(bundle: Bundle) -> list[str]:
    """A note for each scattered volume whose probes lie so far from its centre that halves hold their places coarsely."""
    notes = []
    for grid in bundle.grids:
        if grid.volume.scattered is None:
            continue
        way = grid.volume.scattered.points_world - np.asarray(grid.volume.world_from_local, np.float64)[:3, 3]
        off = float(np.abs(way.astype(np.float16) - way).max())
        if off > COARSE * lattice.cell_size(grid.volume.world_from_local, grid.volume.nodes).min():
            notes.append(f"volume {grid.volume.name}: places of its probes are rounded by up to {100.0 * off:.1f} cm, it is large: "
                         "divide it into several")
    return notes


def notes_on_order(bundle: Bundle) -> list[str]:
    """A note for each volume of an order that engines do not hold."""
    return [f"volume {grid.volume.name}: bands above the second of its order {grid.order} are left out"
            for grid in bundle.grids if grid.order > ORDER]


def export_volumes(field: ProbeField, axes: Axes) -> tuple[ExportVolume, ...]:
    """The volumes of an ``engine_field``, finest cells first: the order in which they are blended."""
    folders = folder_names([lookup.volume.name for lookup in field.lookups])
    return tuple(_export_volume(lookup, folder, axes) for lookup, folder in zip(field.lookups, folders, strict=True))


def export_order(volumes) -> list[int]:
    """The indices of ``volumes`` (ProbeVolume) in the order of ``export_volumes``."""
    return sorted(range(len(volumes)), key=lambda index: lattice.cell_volume(volumes[index].world_from_local,
                                                                             volumes[index].nodes))


def to_half(values: np.ndarray, what: str) -> np.ndarray:
    """``values`` as float16. Raises BakeError naming ``what`` if any is beyond what halves hold."""
    if np.abs(values).max(initial=0.0) > HALF_MAX:
        raise BakeError(f"{what} is brighter than half floats hold ({HALF_MAX:.0f} W/(sr m^2))",
                        "scale the scene's lights down and raise the engine's exposure by as much")
    return np.asarray(values).astype(np.float16)


def _export_volume(lookup: GridLookup, folder: str, axes: Axes) -> ExportVolume:
    nx, ny, nz = (int(count) for count in lookup.volume.resolution)
    width = lookup.tile + 2
    moments = lookup.moments.reshape(nz, ny, nx, width, width, 2) * np.float32([axes.scale, axes.scale**2])
    scattered = lookup.volume.scattered
    offset = lookup.offset_world
    if scattered is not None:
        # They are halves but for the rounding of sums.
        offset = np.where(lookup.live[:, None], lookup.positions, 0.0).astype(np.float16).astype(np.float32).reshape(nz, ny, nx, 3)
    return ExportVolume(
        name=lookup.volume.name, folder=folder, resolution=(nx, ny, nz),
        world_from_local=axes.matrix(lookup.volume.world_from_local),
        centre=axes.vectors(lookup.centre), bias=float(lookup.bias) * axes.scale,
        sh=axes.harmonics(lookup.coefficients).reshape(nz, ny, nx, -1, 3), offset=axes.vectors(offset),
        live=lookup.live.reshape(nz, ny, nx), moments=moments, nodes=tuple(int(count) for count in lookup.volume.nodes),
        words=None if scattered is None else scattered.index.astype(np.float32))


def _as_held(grid: ProbeGrid) -> ProbeGrid:
    count = sh.coefficient_count(ORDER)
    coefficients = np.zeros((*grid.sh.shape[:3], count, 3), np.float32)
    kept = min(count, grid.sh.shape[3])
    coefficients[..., :kept, :] = grid.sh[..., :kept, :]
    # A probe's place decides how surely it sees a point, so what is rounded here must not be rounded again by a texture.
    # Those of scattered probes are held from the volume's centre.
    volume, start = grid.volume, 0.0
    if volume.scattered is not None:
        start = lattice.lattice_points(volume.world_from_local, volume.resolution) - np.asarray(volume.world_from_local)[:3, 3]
    held = (start + grid.offset_world).astype(np.float16) - start
    return replace(grid, sh=coefficients, offset_world=np.where(grid.offset_world != 0, held, 0.0).astype(np.float32))
