"""Which instances a light reaches, and which keep it from others."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Linking:
    """Blender's light and shadow linking of a lamp or of an emissive instance, over ``Scene.instances``.

    ``receivers`` (i,) bool: those that it lights; ``blockers`` (i,) bool: those that cast shadows of its light. None: all.
    """

    receivers: np.ndarray | None = None
    blockers: np.ndarray | None = None

    def taken(self, instances: np.ndarray) -> "Linking":
        """The same for a scene of only the ``instances`` (indices)."""
        return Linking(*(None if part is None else part[instances] for part in (self.receivers, self.blockers)))
