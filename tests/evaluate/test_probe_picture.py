"""The picture shows what it says: exact colours where they are known, the right place for every sphere, the same bytes again."""

from dataclasses import replace

import numpy as np
import pytest
from scene_builders import closed_box, cube_furnace, open_plane
from scene_builders import transform as moved
from scene_builders import volume as grid_volume

from rtgi_addon.errors import BakeError
from rtgi_addon.evaluate.probe_picture import Probes, draw_probes
from rtgi_addon.evaluate.view import View, choose_view
from rtgi_addon.numerics.grid import lattice_points
from rtgi_addon.scene import Camera
from rtgi_addon.storage.png import write_png
from rtgi_addon.techniques import Field, ProbeGrid
from rtgi_addon.transport.context import LightContext

Image = pytest.importorskip("PIL.Image", reason="pictures are read back with Pillow, which comes with matplotlib")
SIZE = (160, 120)
L0 = 2.0 * np.sqrt(np.pi)  # the coefficient of a constant radiance of 1


class UniformField(Field):
    """The same radiance from everywhere; ``validity`` (nz, ny, nx) marks probes inside geometry."""

    def __init__(self, volume, radiance=1.0, validity=None, direct_lamps=frozenset()):
        shape = volume.resolution[::-1]
        coefficients = np.zeros((*shape, 4, 3), np.float32)
        coefficients[..., 0, :] = L0 * radiance
        self._radiance, self.direct_lamps = radiance, direct_lamps
        self._grid = ProbeGrid(volume, coefficients, np.ones(shape, np.float32) if validity is None else validity,
                               np.ones((*shape, 8, 8, 2), np.float32), np.zeros((*shape, 3), np.float32),
                               np.zeros(shape, np.float32))

    def irradiance(self, points, normals):
        return np.full((len(points), 3), np.pi * self._radiance, np.float32)

    def arrays(self):
        return {}

    def grids(self):
        return (self._grid,)


def drawn(scene, field, tmp_path, name="picture.png", **options):
    """The picture as (h, w, 3) integers."""
    path = draw_probes(scene, field, tmp_path / name, SIZE, **options)
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def looking(at=(0.0, 0.0, 0.0), distance=0.9):
    """A camera on −Y that looks along +Y at ``at``, 60° wide."""
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    world_from_camera[:3, 3] = np.add(at, (0, -distance, 0))
    half, near, far = np.tan(np.radians(30)), 0.01, 100.0
    clip = np.array([[1 / half, 0, 0, 0], [0, SIZE[0] / SIZE[1] / half, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return Camera("camera", world_from_camera, clip, SIZE)


def test_png_reads_back_with_its_first_row_on_top(tmp_path):
    pixels = np.random.default_rng(0).integers(0, 256, (7, 5, 3), np.uint8)
    (tmp_path / "folder").mkdir()
    path = write_png(tmp_path / "folder" / "a.png", pixels)
    assert np.array_equal(np.asarray(Image.open(path)), pixels)
    assert [file.name for file in path.parent.iterdir()] == ["a.png"]


def test_a_picture_that_cannot_be_written_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match=r"cannot write .*a\.png.*not a directory: correct the path"):
        write_png(tmp_path / "file" / "a.png", np.zeros((1, 1, 3), np.uint8))


def test_a_furnace_is_one_flat_colour(tmp_path):
    # Walls of albedo ½ that emit ½ under radiance 1 leave radiance 1, and so do the probes: nothing can be told apart.
    scene = replace(cube_furnace(albedo=0.5, emission=0.5, resolution=(3, 3, 3)), cameras=(looking(),))
    picture = drawn(scene, UniformField(scene.volumes[0]), tmp_path)
    assert picture.shape == (120, 160, 3)
    assert picture.max() - picture.min() <= 1 and picture.min() > 100


def test_probes_inside_geometry_are_dark_red(tmp_path):
    scene = replace(cube_furnace(albedo=0.5, emission=0.5, resolution=(3, 1, 1)), cameras=(looking(),))
    validity = np.ones((1, 1, 3), np.float32)
    validity[0, 0, 2] = 0.0
    picture = drawn(scene, UniformField(scene.volumes[0], validity=validity), tmp_path)
    red = (picture[..., 0] > 2 * picture[..., 1]) & (picture[..., 0] < 130)
    rows, columns = np.nonzero(red)
    assert red.sum() > 30 and columns.min() > 80 and abs(rows.mean() - 59.5) < 2


def test_spheres_stand_where_their_probes_are(tmp_path):
    # Dark walls, bright probes: what is bright is the spheres, and their centres are the projected lattice.
    scene = replace(closed_box(albedo=0.0, resolution=(2, 1, 2), half_size=1.0), cameras=(looking(distance=0.95),))
    scene = replace(scene, volumes=(grid_volume(resolution=(2, 1, 2), half_size=0.4),))
    picture = drawn(scene, UniformField(scene.volumes[0], direct_lamps=None), tmp_path).sum(axis=-1)
    view = choose_view(scene, LightContext(scene), SIZE)
    centres, _ = view.project(lattice_points(scene.volumes[0].world_from_local, (2, 1, 2)).reshape(-1, 3))
    for x, y in centres:
        rows, columns = np.nonzero(picture[int(y) - 14:int(y) + 14, int(x) - 14:int(x) + 14] > 200)
        assert len(rows) > 30
        assert abs(rows.mean() - 13.5 - (y % 1)) < 1.0 and abs(columns.mean() - 13.5 - (x % 1)) < 1.0
    left = picture[:, :80] > 200
    assert np.count_nonzero(left) == pytest.approx(np.count_nonzero(picture > 200) / 2, rel=0.1)


def test_lamps_light_the_walls_unless_the_field_has_them(tmp_path):
    scene = replace(closed_box(albedo=0.5, light_position=(0.0, 0.6, 0.0)), cameras=(looking(),))
    lit = drawn(scene, UniformField(scene.volumes[0], radiance=1e-6), tmp_path)
    # The back wall is brightest in front of the lamp.
    assert lit[60, 80].sum() > 1.5 * lit[5, 5].sum()
    flat = drawn(scene, UniformField(scene.volumes[0], radiance=1e-6, direct_lamps=None), tmp_path)
    assert np.array_equal(flat[60, 80], flat[5, 5])


@pytest.mark.parametrize("threads", [1, 3])
def test_the_same_bytes_for_any_number_of_threads(tmp_path, threads):
    scene = replace(closed_box(light_position=(0.0, 0.6, 0.0)), cameras=(looking(),))
    field = UniformField(scene.volumes[0])
    draw_probes(scene, field, tmp_path / "a.png", SIZE)
    draw_probes(scene, field, tmp_path / "b.png", SIZE, threads=threads)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_view_projects_its_own_rays_back():
    view = View(looking((0.1, 0.2, 0.3)), SIZE)
    x, y = np.array([3.0, 80.0, 151.5]), np.array([110.0, 60.0, 2.5])
    origins, directions = view.rays(x, y)
    pixels, w = view.project(origins + 1.7 * directions)
    assert np.allclose(pixels, np.stack([x, y], 1), atol=1e-3) and np.all(w > 0)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    # The middle of the picture is what the camera looks along; up is up.
    assert np.allclose(view.rays(np.array([80.0]), np.array([60.0]))[1], [[0, 1, 0]], atol=1e-6)
    assert view.rays(np.array([80.0]), np.array([1.0]))[1][0, 2] > 0


def test_rays_start_at_the_section_and_end_beside_it():
    view = View(looking(distance=5.0), SIZE, section=moved(scale=0.5))
    origins, directions = view.rays(np.array([80.0, 1.0]), np.array([60.0, 1.0]))
    assert np.allclose(origins[0], [0, -0.5, 0], atol=1e-5) and np.allclose(directions[0], [0, 1, 0], atol=1e-6)
    assert np.all(directions[1] == 0)


def test_the_scene_s_camera_is_used_where_it_sees_the_probes():
    scene = replace(closed_box(), cameras=(looking(),))
    view = choose_view(scene, LightContext(scene), (320, 320))
    assert view.camera is scene.cameras[0] and view.section is None and view.resolution == (320, 240)


def test_walls_in_front_are_cut_away():
    outside = replace(closed_box(), volumes=(grid_volume(resolution=(3, 3, 3), half_size=0.8),),
                      cameras=(looking(distance=5.0),))
    view = choose_view(outside, LightContext(outside), SIZE)
    assert view.camera is outside.cameras[0] and view.section is not None
    # Every probe is behind the cut: a ray to it starts before it.
    points = lattice_points(outside.volumes[0].world_from_local, (3, 3, 3)).reshape(-1, 3)
    pixels, _ = view.project(points)
    origins, directions = view.rays(*pixels.T)
    assert np.all(np.einsum("ij,ij->i", points - origins, directions) > 0)


@pytest.mark.parametrize("build", [closed_box, open_plane])
def test_a_scene_without_a_camera_gets_one_that_holds_the_volume(build):
    scene = build()
    view = choose_view(scene, LightContext(scene), SIZE)
    corners = scene.volumes[0].world_from_local @ np.array([[x, y, z, 1] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]).T
    pixels, w = view.project(corners[:3].T)
    assert np.all(w > 0) and np.all(pixels >= 0) and np.all(pixels <= SIZE)
    assert np.ptp(pixels, axis=0).max() > 60
    assert (view.section is None) == (build is open_plane)


def test_a_probe_sphere_shows_irradiance_over_pi():
    volume = grid_volume(resolution=(1, 1, 1))
    field = UniformField(volume, radiance=0.7)
    probes = Probes(field.grids())
    normals = np.array([[0, 0, 1], [0.6, 0, -0.8]], np.float32)
    assert np.allclose(probes.radiance(np.zeros(2, int), normals), 0.7, atol=1e-6)
    field.grids()[0].sh[..., 2, :] = -100.0
    assert np.all(Probes(field.grids()).radiance(np.zeros(2, int), normals) >= 0)
