"""``LpvField``: irradiance from accumulated light propagation volumes."""

import json
from collections.abc import Callable

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ..base import Field, ProbeGrid
from .gather import gather, radiance_sh
from .grid import LpvGrid


class LpvField(Field):
    """Accumulated volumes (4, 3, nz, ny, nx) float32 of ``volume_grids``, finest first (see `gather` for what they mean).

    ``kernels`` (None: numpy) does the gathering; ``resampled`` makes the probe grids on first demand; ``relit`` makes the field
    of another scene; ``bake`` (a LpvBake, None if read from files) is what it was made by, and ``world_volumes`` what part of the
    volumes is the world's light, which is traced and not propagated.
    """

    technique = "lpv"

    def __init__(self, volume_grids: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...], *, params: dict, stats: dict,
                 resampled: Callable[["LpvField"], tuple[ProbeGrid, ...]] | None = None,
                 relit: Callable[[Scene, Progress], "LpvField"] | None = None, kernels=None, bake=None,
                 world_volumes: tuple[np.ndarray, ...] = ()):
        self.volume_grids, self.volumes = tuple(volume_grids), tuple(volumes)
        self.params, self.stats = dict(params), dict(stats)
        self._resampled, self._relit, self._kernels, self._grids = resampled, relit, kernels, None
        self.bake, self.world_volumes = bake, tuple(world_volumes)

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See Field."""
        function = gather if self._kernels is None else self._kernels.lpv_gather
        return function(self.volume_grids, self.volumes, points, normals, self.params.get("dampening", True))

    def radiance_sh(self, points: np.ndarray, order: int) -> np.ndarray:
        """SH coefficients (n, (order + 1)^2, 3) float32 of incident radiance at free ``points`` (n, 3)."""
        return radiance_sh(self.volume_grids, self.volumes, points, order)

    def grids(self) -> tuple[ProbeGrid, ...]:
        """The volumes resampled to the scene's probe volumes, once. Raises BakeError for a field read from files."""
        if self._grids is None:
            if self._resampled is None:
                raise BakeError("these light propagation volumes were read from files, without the scene they were made for",
                                "bake again to get probes")
            self._grids = self._resampled(self)
        return self._grids

    def relight(self, scene: Scene, progress: Progress | None = None) -> "LpvField":
        """The field under the lamps and world of ``scene``: light is captured and propagated anew, the geometry volume stays.

        Raises BakeError if geometry or materials are not those of the bake.
        """
        if self._relit is None:
            raise BakeError("these light propagation volumes were read from files, without their geometry volumes",
                            "bake again to relight them")
        return self._relit(scene, progress or Progress())

    def arrays(self) -> dict[str, np.ndarray]:
        """Every cascade's coefficients, and its lattice as JSON text; ``from_arrays`` reads them back."""
        arrays = {}
        for level, (grid, volume) in enumerate(zip(self.volume_grids, self.volumes, strict=True)):
            arrays[f"cascade{level}.grid"] = np.array(json.dumps({"corner": grid.corner, "cell": grid.cell,
                                                                  "resolution": grid.resolution}))
            arrays[f"cascade{level}.coefficients"] = volume
        return arrays

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], *, params: dict | None = None, stats: dict | None = None) -> "LpvField":
        """The field that gave ``arrays``; it knows irradiance, but neither probe grids nor relighting."""
        grids, volumes = [], []
        while f"cascade{len(grids)}.grid" in arrays:
            stored = json.loads(str(arrays[f"cascade{len(grids)}.grid"]))
            volumes.append(arrays[f"cascade{len(grids)}.coefficients"])
            grids.append(LpvGrid(tuple(stored["corner"]), stored["cell"], tuple(stored["resolution"])))
        return cls(tuple(grids), tuple(volumes), params=params or {}, stats=stats or {})
