"""The noise of the surface cache as a bake tells it, against how probes of several caches differ under the same rays."""

import numpy as np
import pytest
from room_scenes import panel_room
from scene_builders import closed_box

from rtgi_addon.progress import Progress
from rtgi_addon.techniques.lattice.placement import place
from rtgi_addon.techniques.probes.bake import surface_cache
from rtgi_addon.techniques.probes.cache_noise import cache_noise
from rtgi_addon.techniques.probes.gather import Gatherer, gather
from rtgi_addon.techniques.probes.gathering import items_of
from rtgi_addon.techniques.probes.settings import ProbeSettings
from rtgi_addon.transport.context import LightContext

CACHES, RAYS = 6, 2048


def caches_of(scene, settings):
    """Coefficients (CACHES, m, k, 3) of the scene's probes from caches of as many seeds and the same rays, and the noise that is
    told of each, relative to the norm of all probes."""
    context = LightContext(scene, 1)
    placement = place(context, scene.volumes, settings.virtual_offset, Progress())
    probes, found, told = np.flatnonzero(placement.measured), [], []
    for seed in range(CACHES):
        gatherer = Gatherer(context, surface_cache(context, scene.volumes, settings, seed), placement, settings, 5)
        sums = np.zeros((len(placement.positions), 9, 3))
        for part in gather(gatherer, items_of(probes, 1, RAYS), Progress(), "")[2]:
            sums[part.probes] += part.sh
        found.append(sums[probes] / RAYS)
        scale = np.full(len(probes), np.sqrt(np.square(found[-1]).sum(axis=(1, 2)).mean()))
        told.append(cache_noise(gatherer, probes, scale, seed))
    return np.stack(found), np.array(told)


@pytest.mark.parametrize("side", [0.4, 0.8])
def test_the_noise_of_the_cache_is_told(side):
    found, told = caches_of(panel_room(0.6, side, 10.0, resolution=(3, 3, 3)), ProbeSettings(cache_rays=16, texel_size=0.2))
    true = found.var(axis=0, ddof=1).sum() / np.square(found.mean(axis=0)).sum()
    assert true > 0.002**2 and 0.5 < np.sqrt(told.mean() / true) < 1.8, (np.sqrt(told), np.sqrt(true))


def test_without_bounces_there_is_none():
    _, told = caches_of(closed_box(resolution=(2, 2, 2)), ProbeSettings(bounces=0))
    assert not told.any()


def test_four_times_the_rays_halve_it_at_least():
    coarse, fine = (caches_of(closed_box(resolution=(3, 3, 3)), ProbeSettings(cache_rays=rays, texel_size=0.2))[1].mean()
                    for rays in (16, 64))
    assert 0.0 < fine < 0.4 * coarse
