"""A technique that traces nothing: every kind of setting, a bake that can be watched, slowed down, cancelled and made to fail."""

import time
from dataclasses import asdict, dataclass, field

import numpy as np

from rtgi_addon.errors import BakeError
from rtgi_addon.techniques import Field, ProbeGrid, Technique, setting


@dataclass(frozen=True)
class FakeSettings:
    """One setting of every kind a technique may declare."""

    order: int = setting(2, "Order", "Order of the spherical harmonics.", minimum=0, maximum=8)
    error: float | None = setting(0.01, "Error", "Target relative error.", minimum=1e-4, maximum=1.0)
    rays: int | None = setting(None, "Rays", "Rays per probe.", minimum=1, maximum=1_000_000)
    reach: float = setting(0.5, "Reach", "How far light is followed.", unit="m", minimum=0.0)
    bounces: int | None = setting(None, "Bounces", "How often light is reflected.", minimum=0, maximum=64)
    direct: bool = setting(False, "Direct Light", "Add the light of lamps.")
    filtering: str = setting("NONE", "Filtering", "What is done against ringing.", choices=("NONE", "LANCZOS"))
    tile: int = setting(8, "Tile", "Texels along a side.", choices=(8, 16))


class FakeField(Field):
    """Grids of ones with the error they are said to have."""

    technique = "fake"

    def __init__(self, volumes, settings):
        self.params, self.stats = asdict(settings), {"rays": 1000}
        self._grids = tuple(_grid(volume, settings.order) for volume in volumes)

    def irradiance(self, points, normals):
        return np.full((len(points), 3), np.pi, np.float32)

    def arrays(self):
        return {}

    def grids(self):
        return self._grids


def _grid(volume, order):
    nx, ny, nz = volume.resolution
    shape = (nz, ny, nx)
    return ProbeGrid(volume, np.ones((*shape, (order + 1) ** 2, 3), np.float32), np.ones(shape, np.float32),
                     np.ones((*shape, 8, 8, 2), np.float32), np.zeros((*shape, 3), np.float32),
                     np.full(shape, 0.005, np.float32))


@dataclass
class FakeTechnique(Technique):
    """``seconds`` to bake in ``steps`` steps; ``failure`` is raised half way; ``bakes`` collects (scene, settings)."""

    name = "fake"
    label = "Fake"
    description = "Gives every probe the light of a white furnace."
    Settings = FakeSettings
    seconds: float = 0.0
    steps: int = 10
    failure: Exception | None = None
    bakes: list = field(default_factory=list)

    def bake(self, scene, settings, rng, progress, *, threads=None, checkpoint=None):
        self.bakes.append((scene, settings))
        for step in range(self.steps):
            progress.step(step / self.steps, "Tracing probes")
            time.sleep(self.seconds / self.steps)
            if self.failure is not None and 2 * step >= self.steps:
                raise self.failure
        return FakeField(scene.volumes, settings)


NO_ROOM = BakeError("the ceiling is too low", "raise it")
