"""The field of a bake that was made in blocks, put together only as it is asked for: an image of a volume at a time.

A million probes are most of a gigabyte; whoever writes their bundle needs one number of each, or one slice of all, at a time. So
grids here have the methods by which a bundle is written and a report made, and no arrays of all probes but the small ones.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import cached_property

import numpy as np

from ...scene import ProbeVolume
from ..base import Field, GridFacts, ProbeGrid, volumes_by_settings
from ..lattice.dilation import dilated
from ..lattice.field import ProbeField
from ..lattice.lookup import LookupSettings
from .settings import ProbeSettings

# Probes along each axis of a block: near one another, so that a block touches little of the scene, and a multiple of the groups
# that share directions. Larger blocks cost less for each probe; small ones are many enough to share out.
SIDES, BLOCKS = (16, 8), 64

# ``read(block, name)`` is one of the arrays of PreparedBlocks.bake.
Read = Callable[[int, str], np.ndarray]


class Bricks(Sequence):
    """The probes (n,) of each block, counted through ``volumes`` one after the other, x fastest: boxes of up to 16³ probes of one
    volume, in its order, or 8³ where those were few. Made as they are asked for: nothing here grows with the probes."""

    def __init__(self, volumes: tuple[ProbeVolume, ...]):
        self._shapes = [tuple(int(count) for count in reversed(volume.resolution)) for volume in volumes]
        self._first = np.cumsum([0, *(int(np.prod(shape)) for shape in self._shapes)])
        for side in SIDES:
            self._side, self._cuts = side, [tuple(-(-count // side) for count in shape) for shape in self._shapes]
            self._ends = np.cumsum([int(np.prod(cuts)) for cuts in self._cuts])
            if len(self) >= BLOCKS:
                break

    def __len__(self) -> int:
        return int(self._ends[-1])

    def of(self, owner: int) -> range:
        """The blocks of the volume with the number ``owner``."""
        end = int(self._ends[owner])
        return range(end - int(np.prod(self._cuts[owner])), end)

    def slices(self, number: int) -> tuple[slice, slice, slice]:
        """Where in its volume's arrays [z, y, x] block ``number`` lies."""
        owner = self._owner(number)
        place = np.unravel_index(number - self.of(owner).start, self._cuts[owner])
        return tuple(slice(int(k) * self._side, min((int(k) + 1) * self._side, count))
                     for k, count in zip(place, self._shapes[owner], strict=True))

    def __getitem__(self, number: int) -> np.ndarray:
        if not 0 <= number < len(self):
            raise IndexError(number)
        owner = self._owner(number)
        (_, ny, nx), (z, y, x) = self._shapes[owner], (np.arange(part.start, part.stop) for part in self.slices(number))
        return (int(self._first[owner]) + (z[:, None, None] * ny + y[:, None]) * nx + x).reshape(-1)

    def _owner(self, number: int) -> int:
        return int(np.searchsorted(self._ends, number, side="right"))


class BlockGrid(GridFacts):
    """See GridFacts: one volume, from its ``blocks`` (number for ``read``, and where it lies)."""

    fitted = False

    def __init__(self, volume: ProbeVolume, settings: ProbeSettings, blocks: list[tuple[int, tuple[slice, slice, slice]]],
                 read: Read):
        self.volume, self._blocks, self._read = volume, blocks, read
        self.order, self.visibility_size = settings.order, settings.visibility_resolution
        self._shape = tuple(int(count) for count in reversed(volume.resolution))

    def coefficient(self, index: int) -> np.ndarray:
        """See GridFacts; probes inside geometry have their neighbours' light (lattice/dilation.py)."""
        return dilated(self._whole("sh", (3,), lambda sh: sh[:, index]), self.in_the_open, self.volume)

    def visibility_slices(self, first: int, last: int) -> np.ndarray:
        """See GridFacts."""
        side = self.visibility_size
        result = np.empty((last - first, *self._shape[1:], side, side, 2), np.float32)
        for number, (z, y, x) in self._blocks:
            low, high = max(z.start, first), min(z.stop, last)
            if low < high:
                block = self._read(number, "visibility").reshape(*(part.stop - part.start for part in (z, y, x)), side, side, 2)
                result[low - first:high - first, y, x] = block[low - z.start:high - z.start]
        return result

    @cached_property
    def validity(self) -> np.ndarray:
        """See ProbeGrid."""
        return self._whole("validity")

    @cached_property
    def offset_world(self) -> np.ndarray:
        """See ProbeGrid."""
        return self._whole("offset", (3,))

    @cached_property
    def standard_error(self) -> np.ndarray:
        """See ProbeGrid."""
        return self._whole("standard_error")

    def _whole(self, name: str, inner: tuple[int, ...] = (), part=lambda array: array) -> np.ndarray:
        result = np.empty((*self._shape, *inner), np.float32)
        for number, slices in self._blocks:
            result[slices] = part(self._read(number, name)).reshape(*(part.stop - part.start for part in slices), *inner)
        return result


class BlockField(Field):
    """The field of all blocks of a bake of ``volumes`` with ``settings``, as ``read`` has them."""

    technique = "probes"

    def __init__(self, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings, read: Read, direct_lamps: frozenset[str] | None):
        grids, first = {}, 0
        for of_group, members in volumes_by_settings(volumes, settings):
            bricks = Bricks(members)
            for owner, volume in enumerate(members):
                grids[id(volume)] = BlockGrid(volume, of_group, [(first + number, bricks.slices(number))
                                                                 for number in bricks.of(owner)], read)
            first += len(bricks)
        self._grids, self.direct_lamps = tuple(grids[id(volume)] for volume in volumes), direct_lamps
        self.params = {**asdict(settings), "lookup": asdict(LookupSettings())}
        rays, found = (sum(int(read(number, name)[0]) for number in range(first)) for name in ("rays", "found"))
        self.stats = {"rays": rays, "probe_rays": rays, "texels_found_by_blocks": found}

    def grids(self) -> tuple[BlockGrid, ...]:
        """See Field: what bundles and reports ask of grids."""
        return self._grids

    @cached_property
    def whole(self) -> ProbeField:
        """All of it in memory, to be read."""
        return ProbeField([ProbeGrid(
            grid.volume, np.stack([grid.coefficient(index) for index in range((grid.order + 1) ** 2)], axis=3), grid.validity,
            grid.visibility_slices(0, len(grid.validity)), grid.offset_world, grid.standard_error) for grid in self._grids],
            direct_lamps=self.direct_lamps)

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See Field."""
        return self.whole.irradiance(points, normals)

    def radiance_sh(self, points: np.ndarray, order: int = 2) -> np.ndarray:
        """See Field."""
        return self.whole.radiance_sh(points, order)

    def arrays(self) -> dict[str, np.ndarray]:
        """See Field."""
        return self.whole.arrays()
