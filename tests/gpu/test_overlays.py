"""Overlays: spheres in their probes' own light, states, boxes, discs, and surfaces in front of them."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from probe_bakes import QUICK, bake

from rtgi_addon.effects.spheres.maps import SphereMap, SphereProbes
from rtgi_addon.effects.spheres.prefilter import prefiltered
from rtgi_addon.numerics import grid as lattice
from rtgi_addon.numerics import octahedral, sh
from rtgi_addon.preview.overlay_shapes import (
    MOVED,
    PROBE_RADIUS,
    UNUSABLE,
    USABLE,
    Discs,
    box_lines,
    mirror_rows,
    state_colors,
)
from rtgi_addon.preview.overlay_voxels import voxel_rows
from rtgi_addon.preview.settings import OverlaySettings
from rtgi_addon.scene.sphere_probe import BOX, SphereProbe

SIZE = 48, 32


def room():
    return build.closed_box(albedo=(0.7, 0.5, 0.3), light_position=(0.2, -0.3, 0.4), resolution=(2, 2, 2), half_size=0.8)


@pytest.fixture(scope="module")
def field():
    return bake(room(), **QUICK)


def eye(distance=3.0, orthographic=False):
    """Looks along +Y at the origin."""
    from rtgi_addon.transport.views.camera import CameraView
    pose = np.eye(4)
    pose[:3, :3] = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    pose[:3, 3] = 0, -distance, 0
    near, far = 0.1, 50.0
    if orthographic:
        return CameraView(pose, np.array([[0.4 * SIZE[1] / SIZE[0], 0, 0, 0], [0, 0.4, 0, 0],
                                          [0, 0, -2 / (far - near), -(far + near) / (far - near)], [0, 0, 0, 1]]))
    return CameraView(pose, np.array([[1.2 * SIZE[1] / SIZE[0], 0, 0, 0], [0, 1.2, 0, 0],
                                      [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]]))


def drawn(settings, scene=None, **options):
    """The overlay (h, w, 4), row 0 at the bottom, before the surfaces of ``scene``."""
    from rtgi_addon.preview.gbuffer import GBuffer, gbuffer_surfaces
    from rtgi_addon.preview.overlays import Overlays, laid_over
    gbuffer = GBuffer(*SIZE)
    gbuffer.draw(None if scene is None else gbuffer_surfaces(scene), eye().drawn(SIZE))
    overlays = Overlays(settings, **options)
    assert not overlays.is_empty
    return laid_over(np.zeros((*SIZE[::-1], 4), np.float32), overlays.draw(eye(), SIZE, gbuffer.textures))


def pixel(point):
    """Column and row (from the bottom) in which a world point is seen."""
    clip = eye().drawn(SIZE).clip_from_world @ [*point, 1.0]
    return tuple(np.floor((clip[:2] / clip[3] * 0.5 + 0.5) * SIZE).astype(int))


def met(centre, radius, view):
    """Of rays through the middles of the overlay's own texels, four a pixel: which (n,) meet a sphere, their directions and the
    sphere's normals there (m, 3)."""
    x, y = np.meshgrid(*((np.arange(2 * side) + 0.5) / (2 * side) for side in SIZE))
    origins, directions, _ = view.through(x.ravel(), y.ravel())
    to_centre = centre - origins
    along = np.sum(directions * to_centre, axis=1)
    half = radius**2 - (np.square(to_centre).sum(axis=1) - along**2)
    hits = half > 0
    normals = ((along - np.sqrt(np.maximum(half, 0.0)))[:, None] * directions - to_centre)[hits] / radius
    return hits, directions[hits], normals


@pytest.mark.parametrize("orthographic", [False, True])
def test_sphere_probes_are_mirror_balls(gpu_device, orthographic):
    from rtgi_addon.preview.gbuffer import GBuffer
    from rtgi_addon.preview.overlays import Overlays, laid_over
    directions = octahedral.texel_directions(32).astype(np.float64)
    seen = [1.0 + 0.5 * directions, 0.2 + np.square(directions)]
    levels = [prefiltered(values.reshape(1, 32, 32, 3)) for values in seen]
    spheres = SphereProbes([SphereMap(SphereProbe(f"probe {number}", build.transform((2.0 * number - 1.0, 0.3, 0.1)), BOX, 1.0),
                                      tuple(level[0].astype(np.float16) for level in of)) for number, of in enumerate(levels)])
    view, gbuffer = eye(orthographic=orthographic), GBuffer(*SIZE)
    gbuffer.draw(None, view.drawn(SIZE))
    overlays = Overlays(OverlaySettings(probes="light", probe_size=5.0), spheres=spheres)
    picture = laid_over(np.zeros((*SIZE[::-1], 4), np.float32), overlays.draw(view, SIZE, gbuffer.textures))
    expected = np.zeros((4 * SIZE[0] * SIZE[1], 4))
    for number, (*centre, radius) in enumerate(mirror_rows(spheres, 5.0)):
        hits, along, normals = met(np.array(centre), radius, view)
        mirrored = along - 2.0 * np.sum(along * normals, axis=1, keepdims=True) * normals
        expected[hits, :3], expected[hits, 3] = spheres.seen(number, mirrored), 1.0
    expected = expected.reshape(SIZE[1], 2, SIZE[0], 2, 4).mean(axis=(1, 3))
    whole = (expected[..., 3] == 1.0) & (picture[..., 3] == 1.0)
    assert np.count_nonzero(whole) > 40 and np.ptp(expected[whole]) > 0.5
    np.testing.assert_allclose(picture[whole], expected[whole], atol=0.06)
    assert np.abs(picture[whole] - expected[whole]).mean() < 0.01
    assert Overlays(OverlaySettings(probes="validity"), spheres=spheres).is_empty


@pytest.mark.parametrize("order", [1, 2])
def test_probes_are_lit_by_their_own_light(gpu_device, order):
    grid = bake(room(), order=order, **QUICK).grids()[0]
    picture = drawn(OverlaySettings(probes="light", probe_size=4.5), grids=[grid])
    points = lattice.lattice_points(grid.volume.world_from_local, grid.volume.resolution).reshape(-1, 3)
    radius = 4.5 * PROBE_RADIUS * lattice.cell_size(grid.volume.world_from_local, grid.volume.resolution).min()
    # Rays through the middles of the overlay's own texels, four a pixel, against spheres.
    x, y = np.meshgrid(*((np.arange(2 * side) + 0.5) / (2 * side) for side in SIZE))
    base, across, up = eye().rays(SIZE)
    directions = (base + x[..., None] * across + y[..., None] * up).reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    to_probe = points - [0, -3.0, 0]
    along = directions @ to_probe.T
    half = radius**2 - (np.square(to_probe).sum(axis=1) - along**2)
    distance = np.where(half > 0, along - np.sqrt(np.maximum(half, 0.0)), np.inf)
    nearest, met = distance.argmin(axis=1), np.isfinite(distance.min(axis=1))
    normals = (distance.min(axis=1)[:, None] * directions - to_probe[nearest])[met] / radius
    own = grid.sh.reshape(len(points), -1, 3)[nearest[met]] * sh.cosine_coefficients(order)[:, None]
    expected = np.zeros((len(directions), 4))
    expected[met, :3] = np.maximum(np.einsum("nk,nkc->nc", sh.evaluate(normals, order), own), 0.0) / np.pi
    expected[met, 3] = 1.0
    expected = expected.reshape(SIZE[1], 2, SIZE[0], 2, 4).mean(axis=(1, 3))
    whole = (expected[..., 3] == 1.0) & (picture[..., 3] == 1.0)
    assert np.count_nonzero(whole) > 25
    np.testing.assert_allclose(picture[whole], expected[whole], rtol=0.05, atol=0.02)
    assert np.abs(picture[whole] - expected[whole]).mean() < 0.01
    # A sphere of flat faces covers a little less.
    assert 0.85 < picture[..., 3].sum() / expected[..., 3].sum() <= 1.0


def test_states_have_colours(gpu_device, field):
    grid = field.grids()[0]
    validity, offset = np.ones_like(grid.validity), np.zeros_like(grid.offset_world)
    validity[1, 0, 0], offset[0, 0, 1] = 0.0, 1e-3
    grid = replace(grid, validity=validity, offset_world=offset)
    colors = state_colors(grid).reshape(2, 2, 2, 3)
    assert np.array_equal(colors[1, 0, 0], UNUSABLE) and np.array_equal(colors[0, 0, 1], MOVED)
    picture = drawn(OverlaySettings(probes="validity", probe_size=3.0), grids=[grid])
    points = lattice.lattice_points(grid.volume.world_from_local, grid.volume.resolution)
    for index, color in (((1, 0, 0), UNUSABLE), ((0, 0, 1), MOVED), ((0, 0, 0), USABLE)):
        column, row = pixel(points[index])
        found = picture[row, column, :3]
        np.testing.assert_allclose(found / found.max(), color / color.max(), atol=1e-3)


def test_what_stands_in_front_hides_probes(gpu_device, field):
    wall = build.scene([build.plane("wall", 5.0)], [build.material("wall", 0.5)], [])
    turned = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
    settings = OverlaySettings(probes="light", bounds=True)

    def covered(y):
        placed = replace(wall.instances[0], world_from_local=build.transform((0, y, 0), 1.0, turned))
        return drawn(settings, replace(wall, instances=(placed,)), grids=field.grids())[..., 3]

    behind, before, between = covered(5.0), covered(-1.5), covered(0.0)
    assert behind.max() == 1.0
    # Spheres are gone, edges are faint.
    assert 0.0 < before.max() <= 0.26
    assert 0.26 < between.max() and between.sum() < behind.sum()


def test_bounds_are_the_boxes_edges(gpu_device, field):
    volume = field.grids()[0].volume
    ends = box_lines([volume])
    assert ends.shape == (24, 3) and np.allclose(np.linalg.norm(ends[::2] - ends[1::2], axis=1), 1.0)
    picture = drawn(OverlaySettings(bounds=True), grids=field.grids())
    column, row = pixel((0.0, -0.5, 0.5))
    assert picture[row - 1:row + 2, column, 3].max() > 0.2
    column, row = pixel((0.0, -0.5, 0.0))
    assert picture[row, column, 3] == 0.0


def test_discs_lie_on_surfaces(gpu_device):
    points, normals = np.float32([[-0.5, 0, 0], [0.5, 0, 0]]), np.float32([[0, -1, 0], [0, -1, 0]])
    discs = Discs(points, normals, 0.3, np.float32([[1, 0, 0, 0.8], [0, 0, 1, 0.8]]))
    picture = drawn(OverlaySettings(leaks=True), discs=discs)
    for point, channel in zip(points, (0, 2), strict=True):
        column, row = pixel(point)
        np.testing.assert_allclose(picture[row, column, 3], 0.8, atol=0.02)
        assert picture[row, column, channel] == pytest.approx(picture[row, column, 3])
    assert picture[pixel((0, 0, 0))[::-1]][3] == 0.0
    # Their radius: a disc of 0.3 m covers as many pixels as it should.
    area = np.pi * (0.3 / 3.0 * 1.2 * 0.5 * SIZE[1]) ** 2
    assert np.count_nonzero(picture[..., 3] > 0.2) == pytest.approx(2 * area, rel=0.2)


def test_an_image_under_an_overlay(gpu_device, field):
    from rtgi_addon.preview.overlays import laid_over
    from rtgi_addon.preview.textures import upload
    over = np.zeros((4, 6, 4), np.float32)
    over[:2, :2] = 0.25, 0.0, 0.0, 0.5
    result = laid_over(np.ones((2, 3, 4), np.float32), upload(over))
    np.testing.assert_allclose(result[0, 0], [0.75, 0.5, 0.5, 1.0])
    np.testing.assert_allclose(result[1], 1.0)


@pytest.mark.parametrize("what", ["light", "opacity"])
@pytest.mark.parametrize("level", [0, 2])
def test_voxels_are_cubes_that_show_what_their_faces_do(gpu_device, what, level):
    from rtgi_addon import techniques
    from rtgi_addon.progress import Progress
    scene = room()
    settings = techniques.get("cone_tracing").Settings(resolution=12, light="voxels", bounces=0)
    field = techniques.get("cone_tracing").bake(scene, settings, np.random.default_rng(0), Progress())
    rows = voxel_rows(field.hierarchy, level, what)
    picture = drawn(OverlaySettings(voxels=what, voxel_level=level), voxels=field.hierarchy)
    # By numpy: the nearest face that rays through the middles of the overlay's own texels meet.
    x, y = np.meshgrid(*((np.arange(2 * side) + 0.5) / (2 * side) for side in SIZE))
    origins, along, _ = eye().through(x.ravel(), y.ravel())
    nearest, expected = np.full(len(along), np.inf), np.zeros((len(along), 4), np.float32)
    for row in rows.astype(np.float64):
        for face in range(6):
            axis, end = face // 2, 2 * (face % 2) - 1
            t = (row[axis] + end * row[3] - origins[:, axis]) / along[:, axis]
            place = origins + along * t[:, None] - row[:3]
            across = np.delete(place, axis, axis=1)
            met = (np.abs(across) < row[3]).all(axis=1) & (t > 0) & (t < nearest) & (row[7 + 4 * face] > 0)
            nearest[met] = t[met]
            expected[met] = row[4 + 4 * face:8 + 4 * face]
    expected = expected.reshape(SIZE[1], 2, SIZE[0], 2, 4).mean(axis=(1, 3))
    assert np.mean(expected[..., 3] > 0) > 0.1 and np.ptp(expected[expected[..., 3] == 1, 0]) > (0.01 if what == "light" else -1)
    assert np.mean(np.abs(picture - expected).max(axis=-1) > 1e-3 * expected[..., :3].max()) < 0.03


def test_voxels_are_those_of_a_technique_that_has_them(gpu_device, field):
    from rtgi_addon.preview.overlays import Overlays
    assert Overlays(OverlaySettings(voxels="light"), grids=field.grids()).is_empty
