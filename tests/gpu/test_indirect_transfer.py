"""Probes of transfer in the preview: the table's light at once, the exact one when the light stands still."""

import time
from dataclasses import replace

import numpy as np
import pytest
from transfer_scenes import bake, room


def settled(light, patience=60.0):
    """Wait until ``light`` has nothing more to say; how often it had."""
    ended, count = time.monotonic() + patience, 0
    while light.busy and time.monotonic() < ended:
        count += light.update()
        time.sleep(0.01)
    assert not light.busy and not light.error, light.error
    return count + light.update()


@pytest.fixture
def light(gpu_device):
    from rtgi_addon.preview.indirect.transfer import TransferLight
    field = bake(room(), rays=64, sites=0)
    asked, exactly = [], field.relight_exactly
    field.relight_exactly = lambda scene, progress: asked.append(scene) or exactly(scene, progress)
    made = TransferLight(field, room())
    yield made, field, asked
    made.close()


def moved(z):
    scene = room()
    return replace(scene, lights=(scene.lights[0], replace(scene.lights[1], direction_world=np.array([0.6, 0.0, z]))))


def test_exact_suns_follow_the_table_s(light):
    made, field, asked = light
    settled(made)
    made.follow(moved(-0.8))
    settled(made)
    assert asked == []
    field.exact_suns = True
    made.follow(moved(-0.7))
    settled(made)
    assert len(asked) == 1


def test_a_change_breaks_an_exact_one_off(light):
    made, field, asked = light
    field.exact_suns = True
    settled(made)
    for z in (-0.9, -0.8, -0.7, -0.6):
        made.follow(moved(z))
    settled(made)
    assert asked[-1].lights[1].direction_world[2] == -0.6 and not made.error
