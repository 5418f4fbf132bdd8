"""What media do to light from cell to cell: closed forms of a step, what scatters and takes nothing, and a room held to paths."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.progress import Progress
from rtgi_addon.scene import ClosedMesh, Medium, Phase
from rtgi_addon.techniques.lpv import TECHNIQUE, LpvSettings
from rtgi_addon.techniques.lpv.geometry_volume import vacuum
from rtgi_addon.techniques.lpv.grid import LpvGrid, total_flux
from rtgi_addon.techniques.lpv.injection import inject
from rtgi_addon.techniques.lpv.media_cells import STEP, kept_in_media
from rtgi_addon.techniques.lpv.propagation import propagate
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.media.table import MediaTable
from rtgi_addon.transport.paths.reference import irradiance_at

GRID = LpvGrid((0.0, 0.0, 0.0), 0.5, (9, 9, 9))
IN_THE_MIDDLE = np.float32([[2.1, 2.3, 2.2]]), np.float32([[0, 0.6, 0.8]]), np.float32([[1, 2, 3]])


def kept(*media):
    return kept_in_media(GRID, MediaTable(media))


def test_absorption_takes_of_every_step():
    absorption = np.array([0.5, 1.0, 0.0])
    blocking = replace(vacuum(GRID), kept=kept(Medium("fog", np.zeros(3), absorption)))
    light = inject(GRID, *IN_THE_MIDDLE)
    left = np.exp(-STEP * GRID.cell * absorption)
    # Nothing has left the volume after three steps.
    expected = np.array([1, 2, 3]) * (1 + left + left**2 + left**3)
    assert total_flux(propagate(light, blocking, 3)) == pytest.approx(expected, rel=1e-5)


def test_scattering_keeps_all_light_and_turns_it():
    factors = kept(Medium("fog", np.full(3, 1.5), np.zeros(3), phase=Phase(anisotropy=0.3)))
    left = np.exp(-STEP * GRID.cell * 1.5)
    assert factors[0] == pytest.approx(1.0)
    assert factors[1] == pytest.approx(left + (1 - left) * 0.3, rel=1e-6)


def test_media_fill_the_cells_that_they_are_in():
    cube = build.cube()
    bounds = ClosedMesh(cube.vertices_local, cube.triangles, build.transform((1.0, 2.25, 2.25), (1.0, 9, 9)))
    factors = kept(Medium("half", np.zeros(3), np.full(3, 2.0), bounds=bounds)).reshape(2, 3, 9, 9, 9)
    assert factors[..., :4] == pytest.approx(np.exp(-STEP * GRID.cell * 2.0)) and np.all(factors[..., 4:] == 1.0)
    assert kept() is None and kept(Medium("far", np.ones(3), bounds=ClosedMesh(
        cube.vertices_local, cube.triangles, build.transform((50.0, 0, 0))))) is None


@pytest.mark.parametrize("scattering", [0.0, 0.35])
def test_a_room_is_dimmed_as_paths_are(scattering):
    """By which share bounced light falls when the room fills with smoke: within an eighth of what paths find (lamps' own light that
    scatters in the smoke is no part of it, so that the lamp is not seen to scatter)."""
    room = build.closed_box(albedo=0.6, half_size=1.0, light_position=(0.2, -0.3, 0.4))
    room = replace(room, lights=tuple(replace(light, scattered=0.0) for light in room.lights))
    smoke = replace(room, media=(Medium("smoke", np.full(3, scattering), np.full(3, 0.25)),))
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-0.8, 0.8, (60, 2)), np.full((60, 1), -1.0)], axis=1).astype(np.float32)
    normals = np.tile(np.float32([[0, 0, 1]]), (60, 1))
    found, exact = [], []
    for scene in (room, smoke):
        field = TECHNIQUE.bake(scene, LpvSettings(order=1), np.random.default_rng(0), Progress())
        found.append(field.irradiance(points, normals).mean())
        exact.append(irradiance_at(LightContext(scene), points, normals, 512).mean.mean())
    assert found[1] / found[0] == pytest.approx(exact[1] / exact[0], rel=0.125)
