"""A technique that is wrong by a known amount: a constant field, off by a systematic share and by noise of its seed."""

from dataclasses import dataclass

import numpy as np

from rtgi_addon.errors import BakeError
from rtgi_addon.techniques import ProbeGrid, Technique, setting
from rtgi_addon.techniques.lattice.field import ProbeField


@dataclass(frozen=True)
class OffsetSettings:
    """How wrong."""

    offset: float = setting(0.1, "Offset", "Share that every bake is off by", "", -1.0, 9.0)
    noise: float = setting(0.0, "Noise", "Standard deviation between seeds", "", 0.0, 9.0)


class OffsetTechnique(Technique):
    """Radiance ``truth``·(1 + offset + noise) from everywhere; ``refuses`` makes every bake fail."""

    name = "offset"
    label = "Known Offset"
    description = "Wrong by a known amount, for tests"
    Settings = OffsetSettings

    def __init__(self, truth=2.0, refuses=False, on_bake=None):
        self.truth, self.refuses, self.on_bake, self.bakes = truth, refuses, on_bake, []

    def sweep(self):
        """From very wrong to nearly right."""
        return OffsetSettings(offset=0.5), OffsetSettings(), OffsetSettings(offset=0.02, noise=0.01)

    def bake(self, scene, settings, rng, progress, *, threads=None, checkpoint=None):
        """Constant probes."""
        if self.refuses:
            raise BakeError("the ceiling is too low", "raise it")
        progress.step(0.5, "guessing")
        self.bakes.append(settings)
        if self.on_bake is not None:
            self.on_bake(len(self.bakes))
        radiance = self.truth * (1 + settings.offset + settings.noise * rng.standard_normal())
        return ProbeField([constant_grid(volume, radiance) for volume in scene.volumes], stats={"rays": 0})


def constant_grid(volume, radiance):
    """Probes of order 2 that see ``radiance`` everywhere, however far they look."""
    shape = tuple(reversed(volume.resolution))
    coefficients = np.zeros((*shape, 9, 3), np.float32)
    coefficients[..., 0, :] = radiance * np.sqrt(4 * np.pi)
    far = np.full((*shape, 8, 8, 2), 1e4, np.float32)
    return ProbeGrid(volume, coefficients, np.ones(shape, np.float32), far, np.zeros((*shape, 3), np.float32),
                     np.full(shape, np.nan, np.float32))
