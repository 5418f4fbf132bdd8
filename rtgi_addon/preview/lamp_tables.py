"""The tables of lamps' profiles on the GPU, one texture each, kept as long as a lamp has them."""

import gpu
import numpy as np

from ..scene import Light
from .programs import PROFILE_TABLES
from .textures import upload

_FIELDS = dict(zip(PROFILE_TABLES, ("by_direction", "by_place", "by_distance"), strict=True))


class LampTables:
    """Textures of the profiles of one scene's lamps after another."""

    def __init__(self):
        self._none = upload(np.ones((1, 1, 4), np.float32))
        # With the table, so that its id stays its own.
        self._sent: dict[int, tuple[np.ndarray, gpu.types.GPUTexture]] = {}

    def of(self, light: Light) -> dict[str, gpu.types.GPUTexture]:
        """The samplers PROFILE_TABLES for ``light``."""
        return {name: self._table(None if light.profile is None else getattr(light.profile, field))
                for name, field in _FIELDS.items()}

    def keep(self, lights: tuple[Light, ...]) -> None:
        """Drop what none of ``lights`` has."""
        wanted = {id(getattr(light.profile, field)) for light in lights if light.profile is not None for field in _FIELDS.values()}
        self._sent = {key: sent for key, sent in self._sent.items() if key in wanted}

    def _table(self, values: np.ndarray | None) -> gpu.types.GPUTexture:
        if values is None:
            return self._none
        if id(values) not in self._sent:
            rows = np.ones((*values.shape[:-1], 4), np.float32)
            rows[..., :3] = values
            rows = rows if rows.ndim == 3 else rows[None]
            self._sent[id(values)] = values, upload(rows)
        return self._sent[id(values)][1]
