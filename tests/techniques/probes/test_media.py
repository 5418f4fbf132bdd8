"""Probes in and around media, held to paths that know no cache: within 2 %."""

from dataclasses import replace

import numpy as np
import pytest
from scene_builders import closed_box, cube, transform, volume

from rtgi_addon.errors import BakeError
from rtgi_addon.progress import Progress
from rtgi_addon.scene import ClosedMesh, DensityGrid, Medium, Phase
from rtgi_addon.techniques import get
from rtgi_addon.techniques.probes.settings import ProbeSettings
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import probe_sh


def room(*media):
    probes = volume(resolution=(2, 1, 1), half_size=(0.5, 0.1, 0.1))
    return replace(closed_box(albedo=0.5, light_position=(0.3, 0.2, 0.6)), media=media, volumes=(probes,))


def block(**what):
    """A medium in a box within the room, one probe inside and the other out."""
    bounds = ClosedMesh(cube().vertices_local, cube().triangles, transform((-0.5, 0, 0), (0.4, 0.8, 0.8)))
    return Medium("fog", bounds=bounds, **what)


def baked(scene, **settings):
    field = get("probes").bake(scene, replace(ProbeSettings(), **settings), np.random.default_rng(0), Progress())
    return field, field.grids()[0].sh.reshape(2, -1, 3)


def held_to_paths(scene, samples=1 << 12, tolerance=0.02, **settings):
    _, ours = baked(scene, **settings)
    grid = scene.volumes[0]
    points = np.array([[-0.25, 0, 0], [0.25, 0, 0]], np.float32)
    assert np.allclose(grid.world_from_local[:3, 3], 0)
    truth = probe_sh(LightContext(scene), points, 2, samples)
    error = np.linalg.norm(ours - truth.mean, axis=(1, 2)) / np.linalg.norm(truth.mean, axis=(1, 2))
    noise = np.linalg.norm(truth.standard_error, axis=(1, 2)) / np.linalg.norm(truth.mean, axis=(1, 2))
    assert np.all(error < tolerance + 2 * noise), (error, noise)


def test_absorption():
    scene = room(block(absorption=np.array([1.5, 0.5, 0.0])))
    held_to_paths(scene)
    clear, fog = (baked(each)[1][:, 0] for each in (room(), scene))
    assert np.all(fog[:, 0] < 0.8 * clear[:, 0]) and fog[:, 2] == pytest.approx(clear[:, 2], rel=0.02)


def test_light_of_its_own():
    held_to_paths(room(block(emission=np.array([1.0, 0.2, 0.0]), absorption=np.full(3, 0.5))))


@pytest.mark.slow
def test_scattering():
    held_to_paths(room(block(scattering=np.array([1.0, 0.5, 0.2]), phase=Phase(anisotropy=0.5))), samples=1 << 14, tolerance=0.03,
                  error=0.02)


@pytest.mark.slow
def test_a_grid_that_scatters_and_glows():
    rng = np.random.default_rng(1)
    grid = DensityGrid(transform((-0.5, 0, 0), (0.4, 0.8, 0.8)), rng.uniform(0, 2, (4, 4, 4)).astype(np.float32),
                       emission=rng.uniform(0, 1, (4, 4, 4, 3)).astype(np.float32))
    smoke = Medium("smoke", np.full(3, 0.5), np.full(3, 0.5), np.array([0.3, 0.2, 0.1]), grid=grid)
    held_to_paths(room(smoke), samples=1 << 14, tolerance=0.03, error=0.02)


def test_relighting_follows_media_that_do_not_scatter():
    scene = room(block(absorption=np.full(3, 1.0), emission=np.full(3, 0.5)))
    brighter = replace(scene, lights=(replace(scene.lights[0], intensity=scene.lights[0].intensity * 2),))
    again = baked(scene)[0].relight(brighter).grids()[0].sh
    assert again[..., 0, :] == pytest.approx(baked(brighter)[0].grids()[0].sh[..., 0, :], rel=0.02)
    hazy = baked(room(block(scattering=np.full(3, 0.5))), rays=64)[0]
    with pytest.raises(BakeError, match="cannot be relit"):
        hazy.relight(room(block(scattering=np.full(3, 0.5))))
