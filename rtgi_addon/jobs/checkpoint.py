"""The checkpoint of a bake: the techniques' parts in the workplace beside the bundle, saved by the clock."""

import time

import numpy as np

from ..storage.parts import Parts
from ..storage.workplace import Workplace
from ..techniques import Checkpoint


class FileCheckpoint(Checkpoint):
    """Parts of the bake in the workplace ``place``, which depends on ``run`` (``jobs.fingerprint``).

    ``due`` turns true ``interval`` seconds after the last save (0: always). ``resumed`` says that parts were found.
    """

    def __init__(self, place: Workplace, run: dict[str, str], *, resume: bool, interval: float = 10.0):
        """Raises BakeError as ``Parts`` does."""
        self.parts = Parts(place, run, resume=resume)
        self.interval = interval
        self._last = time.monotonic()

    @property
    def resumed(self) -> bool:
        """True if there were parts to continue from."""
        return self.parts.resumed

    @property
    def due(self) -> bool:
        """True if the last ``save`` lies ``interval`` seconds back."""
        return time.monotonic() - self._last >= self.interval

    def save(self, name: str, arrays: dict[str, np.ndarray]) -> None:
        """Store ``arrays`` under ``name`` in one step. Raises BakeError if the disk refuses."""
        self.parts.save(name, arrays)
        self._last = time.monotonic()

    def load(self, name: str) -> dict[str, np.ndarray] | None:
        """What was stored under ``name``, or None. Raises BakeError for a part that is damaged or of another bake."""
        found = self.parts.load(name)
        return None if found is None else found[0]
