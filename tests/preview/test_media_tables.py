"""Media as texels: boxes are boxes, other meshes are shares of cells, and grids lie where the table says."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.preview.media_tables import TEXELS, box_of, media_texels
from rtgi_addon.scene import ClosedMesh, DensityGrid, Medium, Phase
from rtgi_addon.transport.media.phase import phase_value

CUBE = build.cube(half_size=0.5)


def closed(mesh, *placed):
    return ClosedMesh(mesh.vertices_local, mesh.triangles, build.transform(*placed))


def rows_of(media):
    """The rows (n, TEXELS, 4) of the table, and the cells (c, 3)."""
    texels = media_texels(tuple(media))
    return texels.table.reshape(-1, TEXELS, 4)[:texels.count], texels.cells.reshape(-1, 4)[:, :3]


def test_a_box_is_known_wherever_it_stands():
    turned = build.transform((1, 2, 3), (2, 1, 0.5), np.float64([[0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    matrix = box_of(ClosedMesh(CUBE.vertices_local, CUBE.triangles, turned))
    corners = np.abs(np.linalg.inv(matrix) @ np.append(turned[:3, :3] @ [0.5, -0.5, 0.5] + turned[:3, 3], 1.0))
    assert np.allclose(corners, 1.0)
    assert box_of(closed(build.sphere("ball", 1.0, 2), (0, 0, 0))) is None
    sheared = ClosedMesh(CUBE.vertices_local + 0.2 * CUBE.vertices_local[:, 2:], CUBE.triangles, np.eye(4))
    assert box_of(sheared) is None


def test_what_fills_a_mesh_is_counted_cell_by_cell():
    ball = Medium("ball", np.ones(3), bounds=closed(build.sphere("ball", 1.0, 4), (0, 0, 5)))
    (row,), cells = rows_of([ball])
    assert row[0, 3] == 1 and tuple(row[6, :3]) == (64, 64, 64) and row[6, 3] == row[7, 0] == row[7, 1] == 0
    volume = cells[:, 0].reshape(64, 64, 64).sum() * (2 / 64) ** 3
    assert volume == pytest.approx(4 / 3 * np.pi, rel=0.01) and cells.min() == 0 and cells.max() == 1


def test_grids_follow_each_other_and_colours_are_multiplied():
    rng = np.random.default_rng(1)
    density, colour = rng.random((2, 3, 4), np.float32), rng.random((2, 3, 4, 3), np.float32)
    plain = Medium("plain", np.ones(3), grid=DensityGrid(np.eye(4), density))
    coloured = Medium("coloured", np.ones(3), grid=DensityGrid(np.eye(4), density, colour, None, colour))
    fog = Medium("fog", np.full(3, 0.1))
    rows, cells = rows_of([plain, fog, coloured])
    assert rows[1, 0, 3] == 0 and rows[1, 6, 0] == 0
    assert np.allclose(cells[:24, 0], density.ravel()) and rows[0, 6, 3] == rows[0, 7, 0] == 0 and rows[0, 7, 1] == -1
    first, second, third = (int(value) for value in (rows[2, 6, 3], rows[2, 7, 0], rows[2, 7, 1]))
    assert (first, second, third) == (24, 48, 72)
    assert np.allclose(cells[24:48], (density[..., None] * colour).reshape(-1, 3))
    assert np.allclose(cells[72:], colour.reshape(-1, 3))
    assert np.allclose(cells[48:72, 1], density.ravel())


@pytest.mark.parametrize("phase", [Phase(anisotropy=0.6), Phase("RAYLEIGH"), Phase("DRAINE", 0.4, 2.0), Phase("MIE", diameter=7.0)])
def test_lobes_make_the_phase_function(phase):
    (row,), _ = rows_of([Medium("fog", np.ones(3), phase=phase)])
    cosine = np.linspace(-1, 1, 9)
    total = 0.0
    for weight, g, alpha, norm in row[8:10]:
        if weight > 0:
            spread = 1 + g * g - 2 * g * cosine
            total = total + weight * (1 - g * g) * (1 + alpha * cosine**2) / (4 * np.pi * norm * spread**1.5)
    assert np.allclose(total, phase_value(phase, cosine), rtol=1e-3)
