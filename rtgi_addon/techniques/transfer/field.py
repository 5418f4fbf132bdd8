"""``TransferField``: probes that carry what they make of any light."""

from dataclasses import replace

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ..base import ProbeGrid
from ..lattice.field import ProbeField
from .data import Transfer
from .exact import exact_suns
from .follow import lighting_in
from .lighting import Lighting
from .relight import relit
from .stored import StoredForm, stored_forms
from .surfaces import require_surfaces


class TransferField(ProbeField):
    """The field of ``transfer`` under the light it was baked with, and under any other."""

    technique = "transfer"
    # Whether whoever has the scene at hand should follow suns by rays (``relight_exactly``).
    exact_suns = False

    def __init__(self, transfer: Transfer, *, grids=None, direct_lamps=frozenset(), params=None, stats=None, lookup=None,
                 relit=None):
        super().__init__(grids or tuple(grid.grid for grid in transfer.grids), direct_lamps=direct_lamps, params=params,
                         stats=stats, lookup=lookup, relit=relit)
        self.transfer = transfer

    def with_lookup(self, lookup) -> "TransferField":
        """See ProbeField."""
        return TransferField(self.transfer, grids=self._grids, direct_lamps=self.direct_lamps, params=self.params, stats=self.stats,
                             lookup=lookup, relit=self._relit)

    def relight(self, scene: Scene, progress: Progress | None = None) -> ProbeField:
        """The probes in the light of ``scene``. Raises BakeError if its surfaces are others, or its light cannot be followed."""
        require_surfaces(self.transfer, scene)
        return self.lit_by(lighting_in(self.transfer, scene))

    def relight_exactly(self, scene: Scene, progress: Progress | None = None) -> ProbeField:
        """As ``relight``, with suns that are not those of the bake followed by rays instead of by the table. Raises Cancelled."""
        require_surfaces(self.transfer, scene)
        lighting = lighting_in(self.transfer, scene)
        if lighting.suns is None:
            return self.lit_by(lighting)
        suns = exact_suns(self.transfer, self.params, scene, progress or Progress())
        grids = relit(self.transfer, replace(lighting, suns=()))
        return self._probes(tuple(replace(grid, sh=grid.sh + light) for grid, light in zip(grids, suns, strict=True)))

    def stored_forms(self) -> tuple[StoredForm, ...]:
        """See Field."""
        return stored_forms(self.transfer)

    def lit_by(self, lighting: Lighting) -> ProbeField:
        """The probes under other light. Raises UsageError for a group that does not exist."""
        return self._probes(relit(self.transfer, lighting))

    def _probes(self, grids: tuple[ProbeGrid, ...]) -> ProbeField:
        return ProbeField(grids, direct_lamps=self.direct_lamps, params=self.params, stats=self.stats, lookup=self.lookup)

    def arrays(self) -> dict[str, np.ndarray]:
        """See Field: the probes as they were baked, and the matrices of each volume."""
        arrays = super().arrays()
        for number, grid in enumerate(self.transfer.grids):
            for name in ("sky", "bounce", "suns", "seen", "lights", "local"):
                arrays[f"grid{number}.transfer.{name}"] = getattr(grid, name)
        return arrays
