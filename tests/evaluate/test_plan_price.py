"""What a plan says a bake will cost, held to the bake."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.evaluate.plan.pilot import Pilot
from rtgi_addon.evaluate.plan.price import Prices
from rtgi_addon.evaluate.plan.sample import draw_sample
from rtgi_addon.progress import Progress
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.rays.ray_counter import count_rays

ERROR = 0.1


@pytest.mark.parametrize("lamps", [1, 6])
def test_rays_of_a_bake_with_few_and_with_many_lamps(lamps):
    """Lamps that are too many for shadow rays at every hit take more texels, which the prediction must know."""
    spread = np.random.default_rng(3).uniform(-0.7, 0.7, (lamps, 3))
    scene = replace(build.closed_box(resolution=(2, 2, 2)), lights=tuple(build.point_light(place) for place in spread))
    context = LightContext(scene, 1)
    pilot = Pilot(context, scene.volumes, draw_sample(context, scene.volumes, 64, 5), (2,), ERROR, 5, Progress())
    predicted = Prices(pilot).rays(pilot.measure(((2, 2, 2),), Progress()), ERROR)
    method = techniques.get("probes")
    with count_rays() as counter:
        method.bake(scene, method.Settings(error=ERROR), np.random.default_rng(5), Progress(), threads=1)
    assert predicted == pytest.approx(counter.rays, rel=0.25)
