"""The radiance that arrives at free points, as every technique tells it: the same light as its irradiance."""

import numpy as np
import pytest
import scene_builders as build
from probe_bakes import QUICK

from rtgi_addon.errors import UsageError
from rtgi_addon.numerics import sampling, sh
from rtgi_addon.progress import Progress
from rtgi_addon.techniques import get, registry
from rtgi_addon.techniques.base import radiance_from_irradiance
from rtgi_addon.techniques.lpv.gather import SURFACE_CELLS

SMALL = {"probes": {**QUICK, "order": 2}, "lpv": {"steps": 16, "map_resolution": 32, "dampening": False},
         "rsm": {"resolution": 32, "samples": 4096},
         "vpl": {"lights": 400, "compensation": False}, "transfer": {"rays": 512, "sun_side": 3, "sites": 1},
         "voxel_march": {"resolution": 24, "rays": 1024}, "cone_tracing": {"resolution": 24, "cones": 64}}
POINTS = np.random.default_rng(0).uniform(-0.4, 0.4, (24, 3)).astype(np.float32)


def baked(name, scene, **settings):
    method = get(name)
    return method.bake(scene, method.Settings(**{**SMALL[name], **settings}), np.random.default_rng(0), Progress())


@pytest.fixture(scope="module")
def box():
    """A closed box with a lamp off its centre."""
    return build.closed_box(albedo=0.6, light_position=(0.3, -0.4, 0.5))


@pytest.mark.parametrize("name", list(registry()))
def test_convolved_with_the_cosine_it_is_the_irradiance(box, name):
    field = baked(name, box)
    normals = sampling.fibonacci_sphere(len(POINTS)).astype(np.float32)
    # A surface is given a light propagation volume's light from some way in front of it.
    ahead = SURFACE_CELLS * field.volume_grids[0].cell * normals if name == "lpv" else 0.0
    radiance = field.radiance_sh(POINTS + ahead)
    assert radiance.shape == (len(POINTS), 9, 3) and np.all(np.isfinite(radiance))
    found = np.einsum("nk,nkc->nc", sh.evaluate(normals, 2) * sh.cosine_coefficients(2), radiance)
    expected = field.irradiance(POINTS, normals)
    # SH of order 2 hold irradiance to a percent or two; probes are read by what they see alone, cones are as wide as they are many.
    tolerance = {"probes": 0.06, "transfer": 0.06, "cone_tracing": 0.08}.get(name, 0.03)
    assert np.sqrt(np.mean((found - expected) ** 2)) < tolerance * np.sqrt(np.mean(expected**2))


@pytest.mark.parametrize("name", ["probes", "vpl"])
def test_a_furnace_is_the_same_from_everywhere(name):
    radiance = baked(name, build.cube_furnace(0.5, 1.0)).radiance_sh(POINTS, 1)
    assert radiance[:, 0].mean() == pytest.approx(2 * np.sqrt(4 * np.pi), rel=0.05)
    assert np.abs(radiance[:, 1:]).mean() < 0.05 * radiance[:, 0].mean()


def test_probes_have_what_they_stored_at_their_own_place_and_no_more_bands(box):
    field = baked("probes", box)
    grid = field.grids()[0]
    from rtgi_addon.numerics.grid import lattice_points
    places = lattice_points(grid.volume.world_from_local, grid.volume.resolution).reshape(-1, 3)
    found = field.radiance_sh(places, 3)
    assert np.allclose(found[:, :9], grid.sh.reshape(-1, 9, 3), rtol=1e-3, atol=1e-3 * np.abs(grid.sh).max())
    assert not found[:, 9:].any()
    assert np.array_equal(field.radiance_sh(places, 1), found[:, :4])


def test_what_irradiance_tells_is_what_it_was_made_of():
    class Known(type(baked("probes", build.cube_furnace(0.5, 1.0)))):
        """Irradiance of known radiance, which is positive enough never to be clamped."""

        def __init__(self):
            pass

        def irradiance(self, points, normals):
            return np.einsum("nk,kc->nc", sh.evaluate(normals, 2) * sh.cosine_coefficients(2), LIGHT)

    LIGHT = np.random.default_rng(1).normal(size=(9, 3)) * 0.1
    LIGHT[0] = 3.0
    assert np.allclose(radiance_from_irradiance(Known(), POINTS, 2), LIGHT, atol=1e-5)
    with pytest.raises(UsageError, match="knows irradiance only"):
        radiance_from_irradiance(Known(), POINTS, 3)
