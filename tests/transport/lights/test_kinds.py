"""Every kind of lamp agrees with itself, and is known wherever kinds are told apart."""

from pathlib import Path

import numpy as np
import pytest

import rtgi_addon
from rtgi_addon.numerics.sampling import fibonacci_sphere, sobol_owen
from rtgi_addon.scene import AreaLight, PointLight, SpotLight, SunLight
from rtgi_addon.transport.lights.beam import Beam
from rtgi_addon.transport.lights.kinds import DEFINES, KINDS, kind_number, kind_of
from rtgi_addon.transport.lights.lamps import LampTable
from rtgi_addon.transport.vectors import dot
from rtgi_addon.transport.views.shadow_views import lit_views, texel_power

BOUNDS = np.array([[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]])
HERE, DOWN, COLOR = np.float32([0.2, -0.1, 0.4]), np.float32([0.0, 0.6, -0.8]), np.float32([1.0, 2.0, 0.5])
SIDE = np.float32([1.0, 0.0, 0.0])
LAMPS = {
    "SUN": SunLight("sun", DOWN, COLOR, 0.02),
    "POINT": PointLight("point", HERE, COLOR, 0.05, False),
    "SPOT": SpotLight("spot", HERE, DOWN, COLOR, 1.2, 0.3, 0.0),
    "AREA": AreaLight("area", HERE, 0.3 * SIDE, 0.2 * np.cross(SIDE, DOWN), DOWN, COLOR, "ELLIPSE", 1.0),
}
NAMES = [kind.name for kind in KINDS]


def test_each_kind_has_a_lamp_here_and_a_number_of_its_own():
    assert set(LAMPS) == set(NAMES)
    assert [kind_of(LAMPS[name]).name for name in NAMES] == NAMES
    assert DEFINES == tuple((f"LAMP_{name}", str(number)) for number, name in enumerate(NAMES))
    assert LampTable(tuple(LAMPS[name] for name in NAMES)).kind.tolist() == list(range(len(KINDS)))


@pytest.mark.parametrize("name", NAMES)
def test_the_shader_tells_each_kind_apart(name):
    """Points stand for what is left when the others are told apart."""
    text = (Path(rtgi_addon.__file__).parent / "shaders/include/lamp.glsl").read_text()
    assert f"LAMP_{name}" in text or name == "POINT"


@pytest.mark.parametrize("name", [name for name in NAMES if name != "SUN"])
def test_what_leaves_a_lamp_passes_a_sphere_around_it(name):
    light = LAMPS[name]
    u = sobol_owen(1 << 12, 4, 3)
    sent = kind_of(light).emit(light, u, Beam(BOUNDS, np.zeros(3), 1.0)).power.mean(axis=0)
    radius, away = 30.0, fibonacci_sphere(1 << 14).astype(np.float32)
    points = (HERE + radius * away).astype(np.float32)
    sample = LampTable((light,)).sample(0, points, sobol_owen(len(points), 2, 5))
    arriving = sample.irradiance * np.maximum(-dot(away, sample.direction), 0.0)[:, None]
    np.testing.assert_allclose(arriving.mean(axis=0) * 4.0 * np.pi * radius**2, sent, rtol=0.01)
    mapped = sum(texel_power(light, view).sum(axis=(0, 1), dtype=np.float64)
                 for view in lit_views(light, BOUNDS, 128, kind_number(light)))
    np.testing.assert_allclose(mapped, sent, rtol=0.01)
    # A spot's estimate leaves its soft edge out of account.
    np.testing.assert_allclose(kind_of(light).measure(light, 1.0) * light.strength, sent, rtol=0.3 if name == "SPOT" else 0.01)


def test_what_leaves_a_sun_falls_on_the_plane_across_it():
    light = LAMPS["SUN"]
    beam = Beam(BOUNDS, np.zeros(3), 1.0)
    emission = kind_of(light).emit(light, sobol_owen(1 << 14, 4, 3), beam)
    along = -dot(emission.origins, DOWN[None]) / dot(emission.directions, DOWN[None])
    crossing = emission.origins + emission.directions * along[:, None]
    inside = np.linalg.norm(crossing, axis=1) < 1.0
    falling = (emission.power * (inside * dot(emission.directions, DOWN[None]))[:, None]).mean(axis=0)
    np.testing.assert_allclose(falling, np.pi * light.strength, rtol=0.02)
    np.testing.assert_allclose(kind_of(light).measure(light, 1.0) * light.strength, np.pi * light.strength, rtol=1e-6)
    sample = LampTable((light,)).sample(0, np.zeros((4096, 3), np.float32), sobol_owen(4096, 2, 1))
    np.testing.assert_allclose((sample.irradiance * -dot(sample.direction, DOWN[None])[:, None]).mean(axis=0), light.strength,
                               rtol=1e-3)


WIDE = [
    SunLight("sun", DOWN, COLOR, 0.02), SunLight("wide sun", DOWN, COLOR, 2.0),
    PointLight("ball", HERE, COLOR, 0.3, False), PointLight("disk", HERE, COLOR, 0.3, True),
    SpotLight("spot", HERE, DOWN, COLOR, 1.2, 0.3, 0.2), SpotLight("hard spot", HERE, DOWN, COLOR, 1.2, 0.3, 0.2, False),
    AreaLight("panel", HERE, 0.5 * SIDE, 0.4 * np.cross(SIDE, DOWN), DOWN, COLOR),
    AreaLight("beam", HERE, 0.5 * SIDE, 0.4 * np.cross(SIDE, DOWN), DOWN, COLOR, "RECTANGLE", 1.0),
    AreaLight("disk panel", HERE, 0.5 * SIDE, 0.4 * np.cross(SIDE, DOWN), DOWN, COLOR, "ELLIPSE"),
    AreaLight("disk beam", HERE, 0.5 * SIDE, 0.4 * np.cross(SIDE, DOWN), DOWN, COLOR, "ELLIPSE", 0.8),
    AreaLight("sheared", HERE, 0.5 * SIDE, 0.4 * np.cross(SIDE, DOWN) + 0.2 * SIDE, DOWN, COLOR),
]
# In front of the lamps, near and far, and for spheres also within.
PLACES = [HERE + 0.9 * DOWN, HERE + 1.1 * DOWN + 0.2 * SIDE, HERE + 5.0 * DOWN + 1.0 * SIDE, HERE + 0.1 * DOWN]


@pytest.mark.parametrize("light", WIDE, ids=lambda light: light.name)
def test_rays_meet_a_lamp_where_its_samples_come_from(light):
    table = LampTable((light,))
    for place in PLACES:
        points = np.tile(place, (4096, 1)).astype(np.float32)
        sample = table.sample(0, points, sobol_owen(len(points), 2, 1))
        met = table.meet(0, points, sample.direction)
        drawn = np.any(sample.irradiance > 0, axis=1) & (met.density > 0)
        # The outermost samples may be rounded to beside the lamp.
        assert drawn.sum() >= 0.98 * np.any(sample.irradiance > 0, axis=1).sum()
        found, expected = met.radiance[drawn], sample.irradiance[drawn] * met.density[drawn, None]
        np.testing.assert_allclose(found, expected, rtol=2e-3, atol=2e-3 * max(float(expected.max(initial=0.0)), 1e-9))
        near = np.isfinite(sample.distance[drawn])
        np.testing.assert_allclose(met.distance[drawn][near], sample.distance[drawn][near], rtol=2e-3)
        # The densities are those of the samples: all that lies where light comes from adds up to what the samples say.
        if not np.any(sample.irradiance > 0):
            continue
        axis = sample.direction.mean(axis=0)
        axis /= np.linalg.norm(axis)
        sine = np.sqrt(np.maximum(1.0 - np.min(sample.direction @ axis, initial=1.0), 0.0) * 2.0)
        around, share = _cap(axis, min(1.1 * sine + 1e-3, 2.0))
        there = table.meet(0, np.tile(place, (len(around), 1)).astype(np.float32), around)
        np.testing.assert_allclose(there.radiance.mean(axis=0, dtype=np.float64) * share, sample.irradiance.mean(axis=0), rtol=0.02)


def _cap(axis, chord, count=1 << 16):
    """Directions evenly within a ``chord`` of ``axis``, and their solid angle."""
    turn, height = np.arange(count) * (np.pi * (3.0 - np.sqrt(5.0))), (np.arange(count) + 0.5) / count * 0.5 * chord * chord
    sine = np.sqrt(height * (2.0 - height))
    tangent = np.cross(axis, [0.0, 0.3, 1.0])
    tangent /= np.linalg.norm(tangent)
    local = np.stack([sine * np.cos(turn), sine * np.sin(turn), 1.0 - height], axis=1)
    return (local @ np.stack([tangent, np.cross(axis, tangent), axis])).astype(np.float32), np.pi * chord * chord


def test_rays_meet_no_lamp_without_extent_nor_its_back():
    towards = np.tile(-DOWN, (8, 1)).astype(np.float32)
    for light in (PointLight("point", HERE, COLOR), SunLight("sun", DOWN, COLOR),
                  AreaLight("parallel", HERE, 0.5 * SIDE, 0.4 * np.cross(SIDE, DOWN), DOWN, COLOR, "RECTANGLE", 0.0)):
        assert not LampTable((light,)).meet(0, np.tile(HERE + DOWN, (8, 1)).astype(np.float32), towards).density.any()
    behind = np.tile(HERE - DOWN, (8, 1)).astype(np.float32)
    met = LampTable((WIDE[6],)).meet(0, behind, -towards)
    assert not met.density.any() and not met.radiance.any()
