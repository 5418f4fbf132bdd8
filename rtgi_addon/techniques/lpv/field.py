"""``LpvField``: irradiance from accumulated light propagation volumes."""

import json
from collections.abc import Callable

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ..base import Field, ProbeGrid
from ..lamp_light import LampLight
from .gather import gather, radiance_sh
from .grid import LpvGrid
from .leaks import causes_of_cells


class LpvField(Field):
    """Accumulated volumes (4, 3, nz, ny, nx) float32 of ``volume_grids``, finest first (see `gather` for what they mean), and the
    ``faces`` (6, nz, ny, nx) of each (`standing`; None: all open).

    ``kernels`` (None: numpy) does the gathering; ``resampled`` makes the probe grids on first demand; ``relit`` makes the field
    of another scene; ``bake`` (a LpvBake, None if read from files) is what it was made by, and ``world_volumes`` what part of the
    volumes is the world's light, which is traced and not propagated; ``lamp_light`` comes from lamps directly, beside the volumes.
    """

    technique = "lpv"

    def __init__(self, volume_grids: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...],
                 faces: tuple[np.ndarray | None, ...] | None = None, *, params: dict, stats: dict,
                 resampled: Callable[["LpvField"], tuple[ProbeGrid, ...]] | None = None,
                 relit: Callable[[Scene, Progress], "LpvField"] | None = None, kernels=None, bake=None,
                 world_volumes: tuple[np.ndarray, ...] = (), lamp_light: LampLight | None = None):
        self.volume_grids, self.volumes = tuple(volume_grids), tuple(volumes)
        self.faces = (None,) * len(self.volumes) if faces is None else tuple(faces)
        self.params, self.stats = dict(params), dict(stats)
        self._resampled, self._relit, self._kernels, self._grids = resampled, relit, kernels, None
        self.bake, self.world_volumes, self._lamp_light = bake, tuple(world_volumes), lamp_light
        self.direct_lamps = lamp_light.names if lamp_light else frozenset()

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See Field."""
        function = gather if self._kernels is None else self._kernels.lpv_gather
        propagated = function(self.volume_grids, self.volumes, points, normals, self.params.get("dampening", False),
                              self.faces)
        return propagated + self._lamp_light.irradiance(points, normals) if self._lamp_light else propagated

    def leak_causes(self, context, points: np.ndarray, normals: np.ndarray, excess: np.ndarray) -> np.ndarray:
        """See Field."""
        # By the cells of the finest cascade around each point.
        side = np.full(len(points), max(grid.cell for grid in self.volume_grids))
        for grid in sorted(self.volume_grids, key=lambda grid: -grid.cell):
            side[grid.inside(points)] = grid.cell
        return causes_of_cells(context, side, points, normals)

    @property
    def live_settings(self):
        """See Field."""
        return self.bake.settings if self.bake is not None else None

    def light_volumes(self) -> "LpvField":
        """See Field."""
        return self

    def radiance_sh(self, points: np.ndarray, order: int = 2) -> np.ndarray:
        """See Field; any ``order``, of which bands above 1 are 0."""
        propagated = radiance_sh(self.volume_grids, self.volumes, points, order, self.faces)
        return propagated + self._lamp_light.coefficients(points, order) if self._lamp_light else propagated

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
        """Every cascade's coefficients, faces and lattice as JSON text; ``from_arrays`` reads them back."""
        arrays = {}
        for level, (grid, volume, faces) in enumerate(zip(self.volume_grids, self.volumes, self.faces, strict=True)):
            arrays[f"cascade{level}.grid"] = np.array(json.dumps({"corner": grid.corner, "cell": grid.cell,
                                                                  "resolution": grid.resolution}))
            arrays[f"cascade{level}.coefficients"] = volume
            if faces is not None:
                arrays[f"cascade{level}.faces"] = faces
        return arrays

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], *, params: dict | None = None, stats: dict | None = None) -> "LpvField":
        """The field that gave ``arrays``; it knows irradiance, but neither probe grids nor relighting."""
        grids, volumes, faces = [], [], []
        while f"cascade{len(grids)}.grid" in arrays:
            stored = json.loads(str(arrays[f"cascade{len(grids)}.grid"]))
            volumes.append(arrays[f"cascade{len(grids)}.coefficients"])
            faces.append(arrays.get(f"cascade{len(grids)}.faces"))
            grids.append(LpvGrid(tuple(stored["corner"]), stored["cell"], tuple(stored["resolution"])))
        return cls(tuple(grids), tuple(volumes), tuple(faces), params=params or {}, stats=stats or {})
