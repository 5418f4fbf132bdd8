"""Live probes on the GPU: what the worker has made, as ``ProbeField.irradiance`` has it, and how they follow, fail and end."""

import time
from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from receivers import directions, points_in, relative_error, waited

from rtgi_addon.techniques.probes.live import LiveSettings

SETTINGS = LiveSettings(rays=1 << 16, hysteresis=0.5, noise=0.1)


@pytest.fixture(scope="module")
def make(gpu_device):
    from rtgi_addon.preview.indirect import make_indirect

    def made(scene, settings=SETTINGS):
        return make_indirect(None, scene, live=settings)

    return made


def box(intensity=1.0):
    return build.closed_box(0.5, intensity=intensity, light_position=(0.2, -0.3, 0.4), resolution=(3, 3, 3))


def test_what_is_shown_is_the_field_and_follows_a_lamp(make):
    from rtgi_addon.preview.indirect.base import irradiance
    points, normals = points_in(0.9, 500), directions(500)
    light = make(box())
    # Dark until its first frame, and drawable.
    assert np.all(irradiance(light, points, normals) == 0) and light.busy
    assert waited(light) and not light.busy and light.error is None
    assert np.quantile(relative_error(light, light.field, points, normals), 0.99) < 1e-5
    before = light.field.irradiance(points, normals).mean()
    assert light.follow(box(3.0)) and light.busy and waited(light)
    assert light.field.irradiance(points, normals).mean() == pytest.approx(3.0 * before, rel=0.05)
    # Nothing changes: nothing new is shown.
    assert light.follow(box(3.0)) and not waited(light)
    light.close()


def test_closing_does_not_wait_for_the_light_to_settle(make):
    light = make(box(), replace(SETTINGS, rays=1024, noise=1e-4, hysteresis=0.995))
    started = time.monotonic()
    while light.field is None and time.monotonic() < started + 60.0:
        light.update()
    light.close()
    assert light.field is not None and light._worker is None


def test_what_cannot_be_followed_is_said_and_mended_by_the_next_scene(make):
    light = make(replace(box(), volumes=()))
    assert not waited(light) and "no probe volume" in light.error
    light.follow(box())
    assert waited(light) and light.error is None
    light.close()
