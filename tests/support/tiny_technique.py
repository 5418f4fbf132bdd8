"""A technique that bakes numbers instead of light, in parts that can be paused, failed and resumed: for tests of the job code.

Run as a script it is the command line with this technique in place of the real ones.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

import rtgi_addon.techniques as techniques
from rtgi_addon.techniques import Checkpoint, Field, ProbeGrid, Technique, setting

TILE = 4


class TinyField(Field):
    """The grids and nothing to evaluate."""

    technique = "tiny"

    def __init__(self, grids, includes_direct, stats):
        self._grids, self.stats, self.params = tuple(grids), stats, {}
        self.direct_lamps = None if includes_direct else frozenset()

    def irradiance(self, points, normals):
        """Nowhere any light."""
        return np.zeros((len(points), 3), np.float32)

    def arrays(self):
        """The coefficients."""
        return {grid.volume.name: grid.sh for grid in self._grids}

    def grids(self):
        """One per volume."""
        return self._grids


class TinyTechnique(Technique):
    """Random coefficients, slice by slice; every slice is saved once a checkpoint is due."""

    name = "tiny"
    label = "Tiny"
    description = "Random numbers for tests"

    @dataclass(frozen=True)
    class Settings:
        """As many as the command line knows, and three that make trouble on demand."""

        order: int = setting(1, "Order", "SH order", minimum=0, maximum=4)
        rays: int | None = setting(None, "Rays", "Rays per probe", minimum=1, maximum=1000)
        error: float = setting(0.01, "Error", "Target", minimum=1e-4, maximum=1.0)
        bounces: int | None = setting(None, "Bounces", "Bounces", minimum=0, maximum=99)
        direct: bool = setting(False, "Direct", "Direct light")
        pause: float = setting(0.0, "Pause", "Seconds per slice", minimum=0.0, maximum=60.0)
        fail_at: int = setting(-1, "Fail", "Slice that raises", minimum=-1, maximum=999)
        not_finite: bool = setting(False, "NaN", "Leave a NaN in the result")

    def bake(self, scene, settings, rng, progress, *, threads=None, checkpoint=None):
        """Random grids for every volume."""
        checkpoint, base = checkpoint or Checkpoint(), int(rng.integers(2**31))
        total = sum(volume.resolution[2] for volume in scene.volumes)
        done, loaded, grids = 0, 0, []
        for number, volume in enumerate(scene.volumes):
            stored = checkpoint.load(volume.name) or {}
            loaded += len(stored)
            nx, ny, nz = volume.resolution
            slices = {}
            with ThreadPoolExecutor(threads) as pool:
                for z in range(nz):
                    progress.step(done / total, f"slice {z}")
                    if z == settings.fail_at:
                        raise ZeroDivisionError("the worker divided by zero")
                    slices[f"{z}"] = stored.get(f"{z}")
                    if slices[f"{z}"] is None:
                        time.sleep(settings.pause)
                        keys = [(base, number, z, y) for y in range(ny)]
                        slices[f"{z}"] = np.stack(list(pool.map(_row, keys, [nx] * ny, [settings.order] * ny)))
                    done += 1
                    if checkpoint.due:
                        checkpoint.save(volume.name, slices)
            sh = np.stack([slices[f"{z}"] for z in range(nz)])
            if settings.not_finite:
                sh[0, 0, 0, 0, 0] = np.nan
            grids.append(tiny_grid(volume, sh))
        return TinyField(grids, settings.direct, {"rays": 7 * sum(grid.validity.size for grid in grids), "loaded": loaded})


def _row(key, nx, order):
    return np.random.default_rng(key).random((nx, (order + 1) ** 2, 3), dtype=np.float32)


def tiny_grid(volume, sh, **replaced):
    """A grid around coefficients ``sh`` with everything else plausible and different from probe to probe."""
    shape = sh.shape[:3]
    rng = np.random.default_rng(5)
    values = {
        "validity": np.ones(shape, np.float32), "visibility": rng.random((*shape, TILE, TILE, 2), dtype=np.float32),
        "offset_world": np.zeros((*shape, 3), np.float32), "standard_error": np.full(shape, 0.01, np.float32),
    }
    return ProbeGrid(volume, sh, **{**values, **replaced})


def install(monkeypatch=None):
    """Make this the only technique; ``monkeypatch`` puts the real ones back after the test."""
    def registry():
        return {"tiny": TinyTechnique()}

    if monkeypatch is None:
        techniques.registry = registry
    else:
        monkeypatch.setattr(techniques, "registry", registry)


if __name__ == "__main__":
    install()
    from rtgi_addon.__main__ import leave, main

    leave(main())
