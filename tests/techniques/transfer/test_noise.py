"""How noisy probes of transfer say that they are, against how much bakes of other seeds differ."""

import numpy as np
from transfer_scenes import room

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.transfer.lighting import Lighting
from rtgi_addon.techniques.transfer.relight import relit


def baked(seed: int, rays: int = 256):
    technique = techniques.get("transfer")
    return technique.bake(room(), technique.Settings(rays=rays, sun_side=3, sites=2), np.random.default_rng(seed), Progress())


def test_probes_say_how_noisy_they_are():
    fields = [baked(seed) for seed in range(6)]
    grids = [field.grids()[0] for field in fields]
    usable = grids[0].usable
    told = np.sqrt(np.mean([np.mean(grid.standard_error[usable] ** 2) for grid in grids]))
    true = np.sqrt(np.var([grid.sh[usable] for grid in grids], axis=0, ddof=1).mean())
    print(f"told {told:.4g}, true {true:.4g}")
    assert 0.6 < told / true < 1.6
    # More rays, less noise; other light, none that is known.
    more = baked(0, 2048).grids()[0].standard_error[usable]
    assert np.sqrt(np.mean(more**2)) < 0.5 * told
    dim = relit(fields[0].transfer, Lighting(groups={"Lamps": np.full(3, 0.5)}))[0]
    assert np.isnan(dim.standard_error).all() and np.isfinite(grids[0].standard_error[usable]).all()
