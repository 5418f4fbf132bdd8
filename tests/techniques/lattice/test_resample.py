"""Fields resampled to probe grids."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.errors import UsageError
from rtgi_addon.numerics import sh
from rtgi_addon.progress import Progress
from rtgi_addon.techniques import Field
from rtgi_addon.techniques.lattice.resample import resample
from rtgi_addon.transport.context import LightContext


class LinearField(Field):
    """The irradiance of one set of SH coefficients, the same everywhere."""

    technique = "linear"

    def __init__(self, coefficients):
        self.coefficients, self.params, self.stats = coefficients, {}, {}

    def irradiance(self, points, normals):
        """Order-2 irradiance."""
        return sh.irradiance(self.coefficients, normals)

    def arrays(self):
        """The coefficients."""
        return {"sh": self.coefficients}


def coefficients(order=2):
    rng = np.random.default_rng(3)
    values = 0.1 * rng.standard_normal((sh.coefficient_count(order), 3))
    values[0] += 3.0
    return values


@pytest.mark.parametrize("order", [0, 1, 2])
def test_irradiance_is_deconvolved_exactly(order):
    scene = build.closed_box(resolution=(3, 2, 4))
    grid, = resample(LinearField(coefficients()), LightContext(scene), scene.volumes, order, Progress())
    assert grid.sh.shape == (4, 2, 3, sh.coefficient_count(order), 3) and grid.order == order
    assert np.allclose(grid.sh, coefficients()[:sh.coefficient_count(order)], atol=2e-5)
    assert np.all(np.isnan(grid.standard_error)) and np.all(grid.validity == 1) and not grid.offset_world.any()


def test_distances_are_those_to_the_walls():
    scene = build.closed_box(resolution=(1, 1, 1), half_size=0.5)
    scene = replace(scene, volumes=(build.volume(resolution=(1, 1, 1), half_size=0.4),))
    grid, = resample(LinearField(coefficients()), LightContext(scene), scene.volumes, 1, Progress())
    mean, squared = grid.visibility[0, 0, 0, ..., 0], grid.visibility[0, 0, 0, ..., 1]
    assert mean.shape == (8, 8) and 0.5 <= mean.min() < 0.56 and mean.max() < 0.8
    assert np.all(squared >= mean**2 - 1e-6)


def test_a_field_that_projects_radiance_itself_may_have_any_order():
    scene = build.closed_box()
    field, context = LinearField(coefficients()), LightContext(scene)
    with pytest.raises(UsageError, match="order is 4"):
        resample(field, context, scene.volumes, 4, Progress())
    own = coefficients(4).astype(np.float32)
    grid, = resample(field, context, scene.volumes, 4, Progress(), radiance_sh=lambda points: np.tile(own, (len(points), 1, 1)))
    assert np.array_equal(grid.sh[1, 0, 1], own)


def test_probes_inside_geometry_are_filled_from_outside():
    block = build.cube("block", 0.4)
    room = build.closed_box(half_size=2.0, light_position=(1.5, 0.0, 0.0))
    scene = build.scene([*room.meshes, block], lights=room.lights, volumes=[build.volume(resolution=(5, 5, 5), half_size=0.9)])

    class Checked(LinearField):
        def irradiance(self, points, normals):
            assert np.abs(points).max(axis=1).min() > 0.4
            return super().irradiance(points, normals)

    grid, = resample(Checked(coefficients()), LightContext(scene), scene.volumes, 2, Progress())
    assert grid.validity[2, 2, 2] < 0.75 and np.allclose(grid.sh[2, 2, 2], coefficients(), atol=2e-5)


def test_threads_do_not_change_a_bit():
    scene = build.closed_box(resolution=(4, 4, 4))
    one, many = (resample(LinearField(coefficients()), LightContext(scene, threads), scene.volumes, 2, Progress(), threads=threads)
                 for threads in (1, 3))
    assert all(np.array_equal(a.visibility, b.visibility) and np.array_equal(a.sh, b.sh) for a, b in zip(one, many, strict=True))
