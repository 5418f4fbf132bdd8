"""Probe bakes as tests make them: in one call, read as one array, and with a checkpoint in memory."""

import numpy as np

from rtgi_addon.numerics import grid as lattice
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.base import Checkpoint
from rtgi_addon.techniques.probes import TECHNIQUE, ProbeSettings

# Quick settings for everything but accuracy.
QUICK = {"rays": 64, "cache_rays": 16, "texel_size": 0.25}


def bake(scene, seed=0, threads=None, checkpoint=None, progress=None, **settings):
    """The field of a bake with the given settings."""
    return TECHNIQUE.bake(scene, ProbeSettings(**settings), np.random.default_rng(seed), progress or Progress(), threads=threads,
                          checkpoint=checkpoint)


def coefficients(field):
    """SH (p, k, 3) float64 of all probes of all volumes."""
    return np.concatenate([grid.sh.reshape(-1, *grid.sh.shape[3:]) for grid in field.grids()]).astype(float)


def positions(scene):
    """World positions (p, 3) of all lattice points."""
    return np.concatenate([lattice.lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3)
                           for volume in scene.volumes])


def rms(values):
    """Root mean square of an array."""
    return float(np.sqrt(np.mean(np.square(values))))


def bytes_of(field):
    """Every array of a field, for comparison bit by bit."""
    return b"".join(np.asarray(value).tobytes() for _, value in sorted(field.arrays().items()))


class Memory(Checkpoint):
    """Always due; keeps copies, and breaks off after ``stop`` saves."""

    due = True

    def __init__(self, stored=None, stop=None):
        self.stored, self.stop, self.saves = dict(stored or {}), stop, 0

    def save(self, name, arrays):
        self.stored[name] = {key: np.array(value) for key, value in arrays.items()}
        self.saves += 1
        if self.saves == self.stop:
            raise KeyboardInterrupt

    def load(self, name):
        return self.stored.get(name)
