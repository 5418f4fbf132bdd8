"""``ProbeField``: irradiance anywhere from the probe lattices of one or several volumes."""

import json
from dataclasses import asdict, replace
from functools import cached_property

import numpy as np

from ...errors import BakeError
from ...numerics import sh
from ...progress import Progress
from ...scene import ProbeVolume, Scene
from ...scene.scattered import of_grid
from ..base import Field, ProbeGrid
from .leaks import causes_of_probes
from .lookup import GridLookup, LookupSettings

_GRID_ARRAYS = ("sh", "validity", "visibility", "offset_world", "standard_error")


class ProbeField(Field):
    """The field of SH probes in ``probe_grids``, read as ``lookup`` says.

    Of several volumes around a point the one with the smallest cells wins; over its outermost cell it is blended into the next.
    A point outside all of them takes the nearest one's outermost probes. ``params`` are the settings it was baked with, to which
    those of the lookup are added under "lookup".
    """

    technique = "probes"

    def __init__(self, probe_grids, *, direct_lamps: frozenset[str] | None = frozenset(), params: dict | None = None,
                 stats: dict | None = None, lookup: LookupSettings | None = None, relit=None):
        if not probe_grids:
            raise ValueError("a probe field needs at least one grid")
        self._grids = tuple(probe_grids)
        self.direct_lamps = direct_lamps
        self.lookup = lookup or LookupSettings()
        self.params = {**(params or {}), "lookup": asdict(self.lookup)}
        self.stats = dict(stats or {})
        self._relit = relit

    def relight(self, scene: Scene, progress: Progress | None = None) -> "ProbeField":
        """This field under the lamps and world of ``scene``, from the hits of its bake: no probe or form-factor ray is traced.

        Raises BakeError if geometry or materials are not those of the bake, or if the bake kept no hits (it was read from
        files, resumed, or too large).
        """
        if self._relit is None:
            raise BakeError("these probes were read from files, without the hits of their bake", "bake again to relight them")
        return self._relit(scene, progress or Progress())

    def with_lookup(self, lookup: LookupSettings) -> "ProbeField":
        """The same probes, read another way."""
        return type(self)(self._grids, direct_lamps=self.direct_lamps, params=self.params, stats=self.stats, lookup=lookup,
                          relit=self._relit)

    def grids(self) -> tuple[ProbeGrid, ...]:
        """The grids as baked: neither deringed nor dilated."""
        return self._grids

    @classmethod
    def of(cls, field: Field) -> "ProbeField":
        """The grids of ``field``, whatever its technique knows better: what is shipped is what is read. Probes stay as they are."""
        return field if isinstance(field, cls) else cls(field.grids(), direct_lamps=field.direct_lamps)

    def leak_causes(self, context, points: np.ndarray, normals: np.ndarray, excess: np.ndarray) -> np.ndarray:
        """See Field."""
        return causes_of_probes(context, self.lookups, self.shares(points), points, normals, excess)

    def irradiance(self, points: np.ndarray, normals: np.ndarray, surface_normals: np.ndarray | None = None) -> np.ndarray:
        """Irradiance (n, 3) float32 [W·m⁻²] at ``points`` (n, 3) with unit ``normals`` (n, 3), world space; never negative.

        Where ``normals`` are those of bumps, ``surface_normals`` (n, 3) are the surface's own (`weights.py`)."""
        points, normals = np.asarray(points), np.asarray(normals)
        surface_normals = normals if surface_normals is None else np.asarray(surface_normals)
        share = self.shares(points)
        total = np.zeros((len(points), 3), np.float32)
        for lookup, weight in zip(self.lookups, share.T, strict=True):
            inside = np.flatnonzero(weight)
            if len(inside):
                total[inside] += weight[inside, None] * lookup.irradiance(points[inside], normals[inside], surface_normals[inside])
        return total

    def radiance_sh(self, points: np.ndarray, order: int = 2) -> np.ndarray:
        """See Field; any ``order``, of which bands beyond the probes' own are 0. Read by what the probes see alone, for nothing in
        the air has a side, and as it was measured: not deringed."""
        points = np.asarray(points)
        read, share = self._in_the_air, self.shares(points)
        result = np.zeros((len(points), sh.coefficient_count(order), 3), np.float32)
        for lookup, weight in zip(read.lookups, share.T, strict=True):
            inside = np.flatnonzero(weight)
            index, weights = lookup.weights(points[inside], np.zeros((len(inside), 3), np.float32))
            count = min(lookup.coefficients.shape[1], result.shape[1])
            for corner in range(index.shape[1]):
                corner_share = (weight[inside] * weights[:, corner])[:, None, None]
                result[inside, :count] += corner_share * lookup.coefficients[index[:, corner], :count]
        return result

    @cached_property
    def _in_the_air(self) -> "ProbeField":
        return self.with_lookup(replace(self.lookup, reconstruction="linear", normal_weight=False, normal_bias=0.0))

    def arrays(self) -> dict[str, np.ndarray]:
        """The grids' arrays, and the volumes as JSON text; ``from_arrays`` reads them back."""
        arrays = {}
        for number, grid in enumerate(self._grids):
            volume = grid.volume
            arrays[f"grid{number}.volume"] = np.array(json.dumps({
                "name": volume.name, "resolution": [int(count) for count in volume.resolution], "fitted": volume.fitted,
                "world_from_local": np.asarray(volume.world_from_local, np.float64).tolist(), "settings": volume.settings,
                "probes_fitted": grid.fitted,
            }))
            if volume.scattered is not None:
                arrays[f"grid{number}.index"] = volume.scattered.index
            for name in _GRID_ARRAYS:
                arrays[f"grid{number}.{name}"] = getattr(grid, name)
        return arrays

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], *, direct_lamps: frozenset[str] | None = frozenset(),
                    params: dict | None = None, stats: dict | None = None, lookup: LookupSettings | None = None) -> "ProbeField":
        """The field that gave ``arrays``. ``lookup`` None means the one in ``params``, if it is there."""
        grids = []
        while f"grid{len(grids)}.volume" in arrays:
            prefix = f"grid{len(grids)}."
            stored = json.loads(str(arrays[prefix + "volume"]))
            volume = ProbeVolume(stored["name"], np.array(stored["world_from_local"]), tuple(stored["resolution"]),
                                 stored["fitted"], stored["settings"])
            if prefix + "index" in arrays:
                volume = replace(volume, scattered=of_grid(arrays[prefix + "index"], volume.world_from_local,
                                                           arrays[prefix + "offset_world"], arrays[prefix + "validity"]))
            grids.append(ProbeGrid(volume, *(arrays[prefix + name] for name in _GRID_ARRAYS), stored["probes_fitted"]))
        if lookup is None and params and "lookup" in params:
            lookup = LookupSettings(**params["lookup"])
        return cls(grids, direct_lamps=direct_lamps, params=params, stats=stats, lookup=lookup)

    @cached_property
    def lookups(self) -> tuple[GridLookup, ...]:
        """One per grid, finest cells first; made on the first question, since a bake that only writes its grids asks none."""
        return tuple(sorted((GridLookup(grid, self.lookup) for grid in self._grids), key=lambda lookup: lookup.cell_volume))

    def shares(self, points: np.ndarray) -> np.ndarray:
        """Share (n, volumes) float32 of each lookup in each point; rows sum to 1."""
        share = np.zeros((len(points), len(self.lookups)), np.float32)
        left = np.ones(len(points), np.float32)
        for column, lookup in enumerate(self.lookups):
            covered = lookup.coverage(points)
            share[:, column] = left * covered
            left *= 1.0 - covered
        total = share.sum(axis=1)
        outside = np.flatnonzero(total == 0.0)
        if len(outside):
            nearest = np.argmin([lookup.distance(points[outside]) for lookup in self.lookups], axis=0)
            share[outside, nearest] = total[outside] = 1.0
        return share / total[:, None]
