"""What varies with the angle of view: factors over the mean of the cosine-weighted hemisphere."""

import numpy as np


class AngleProfiles:
    """A profile (k, 3) or None for each face (see ``Material.albedo_by_angle``), in one ``table`` (m, 3) whose first row is ones.

    ``present`` tells whether there is any at all.
    """

    def __init__(self, profiles: list[np.ndarray | None]):
        lengths = np.array([0 if profile is None else len(profile) for profile in profiles])
        self.present = bool(lengths.any())
        # Faces without a profile have one step, the row of ones.
        self._steps = np.maximum(lengths, 1).astype(np.float32)
        self._start = np.where(lengths > 0, 1 + np.cumsum(lengths) - lengths, 0)
        rows = [np.ones((1, 3), np.float32), *(profile for profile in profiles if profile is not None)]
        self.table = np.concatenate(rows).astype(np.float32)

    def rows(self, face: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Row (n,) of the table for light that leaves ``face`` (n,) under ``cosine`` (n,), of either sign, to its normal."""
        steps = self._steps[face]
        step = np.minimum(np.square(cosine) * steps, steps - 1)
        return self._start[face] + step.astype(np.int32)

    def of(self, face: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """The factor (n, 3)."""
        return self.table[self.rows(face, cosine)]
