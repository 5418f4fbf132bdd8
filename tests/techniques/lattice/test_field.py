from dataclasses import replace

import numpy as np
import pytest

from rtgi_addon.numerics import grid as lattice
from rtgi_addon.numerics import octahedral, sampling, sh
from rtgi_addon.scene import ProbeVolume
from rtgi_addon.techniques.base import ProbeGrid
from rtgi_addon.techniques.lattice.dilation import dilate, live_probes
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.techniques.lattice.lookup import LookupSettings
from rtgi_addon.techniques.lattice.reconstruction import RECONSTRUCTIONS
from rtgi_addon.techniques.lattice.weights import seen_share

TRILINEAR = LookupSettings(visibility=False, normal_weight=False)
UNIT_L0 = np.sqrt(4 * np.pi)


def _matrix(scale=(1.0, 1.0, 1.0), centre=(0.0, 0.0, 0.0), rotation=None):
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) if rotation is None else rotation) @ np.diag(scale)
    matrix[:3, 3] = centre
    return matrix


def _grid(matrix, resolution, radiance, distance=lambda points, directions: np.full(len(directions), 1e3), order=2, tile=8,
          name="Volume"):
    """A grid of uniform radiance ``radiance(points)`` and distance moments of ``distance(point, directions)``, filtered as DDGI
    does (cosine to the 50th)."""
    volume = ProbeVolume(name, matrix, resolution)
    points = lattice.lattice_points(matrix, resolution)
    shape = points.shape[:3]
    coefficients = np.zeros((*shape, (order + 1) ** 2, 3), np.float32)
    coefficients[..., 0, :] = UNIT_L0 * np.asarray(radiance(points))[..., None]
    directions = sampling.fibonacci_sphere(2048)
    smear = np.maximum(octahedral.texel_directions(tile) @ directions.T, 0) ** 50
    smear /= smear.sum(axis=1, keepdims=True)
    lengths = np.array([distance(point, directions) for point in points.reshape(-1, 3)])
    moments = np.stack([lengths @ smear.T, lengths**2 @ smear.T], axis=-1)
    return ProbeGrid(volume, coefficients, np.ones(shape, np.float32), moments.reshape(*shape, tile, tile, 2).astype(np.float32),
                     np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32))


def _inside_box(low, high):
    """Distance to the walls of a box from within."""
    def distance(point, directions):
        with np.errstate(divide="ignore"):
            return np.min(np.maximum((low - point) / directions, (high - point) / directions), axis=1)
    return distance


def _points(n, low, high, seed=0):
    return np.random.default_rng(seed).uniform(low, high, (n, 3))


@pytest.mark.parametrize("reconstruction", RECONSTRUCTIONS)
@pytest.mark.parametrize("visibility", [True, False])
def test_constant_radiance_gives_pi_l_everywhere(reconstruction, visibility):
    grid = _grid(_matrix((2, 1, 1)), (4, 2, 3), lambda points: np.full(points.shape[:3], 0.7), _inside_box(-3.0, 3.0))
    field = ProbeField([grid], lookup=LookupSettings(reconstruction, visibility))
    points, normals = _points(300, -3, 3), sampling.fibonacci_sphere(300)
    value = field.irradiance(points, normals)
    assert value.shape == (300, 3) and value.dtype == np.float32
    assert np.allclose(value, 0.7 * np.pi, rtol=1e-5)


def test_linear_between_two_probes():
    grid = _grid(_matrix(), (2, 1, 1), lambda points: points[..., 0] + 1)
    x = np.linspace(-0.5, 0.5, 21)
    points = np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1)
    value = ProbeField([grid], lookup=TRILINEAR).irradiance(points, np.tile([0.0, 0, 1], (21, 1)))
    assert np.allclose(value, np.pi * (x + 1)[:, None], rtol=1e-5)
    outside = ProbeField([grid], lookup=TRILINEAR).irradiance(np.array([[-9.0, 0, 0], [9, 0, 0]]), np.array([[0.0, 0, 1]] * 2))
    assert np.allclose(outside, np.pi * np.array([[0.5], [1.5]]), rtol=1e-5)


def test_evaluates_the_direction_as_the_probes_do():
    rng = np.random.default_rng(1)
    grid = _grid(_matrix(), (1, 1, 1), lambda points: np.ones(points.shape[:3]))
    coefficients = (0.1 * rng.normal(size=grid.sh.shape) + grid.sh).astype(np.float32)
    normals = sampling.fibonacci_sphere(50)
    expected = sh.irradiance(coefficients.reshape(9, 3), normals)
    assert expected.min() > 0
    assert np.allclose(ProbeField([replace(grid, sh=coefficients)]).irradiance(_points(50, -1, 1), normals), expected, rtol=1e-5)


def _two_rooms(rotation=None, centre=(0.0, 0.0, 0.0), phase=0.0):
    """Two cubes of side 2 with a wall of no thickness at local x = ``phase``, light 1 on the left and none on the right."""
    matrix = _matrix((2, 1, 1), centre, rotation)
    turn = np.eye(3) if rotation is None else rotation

    def distance(point, directions):
        local, turned = (point - centre) @ turn, directions @ turn
        low, high = ((-2.0, -1, -1), (phase, 1, 1)) if local[0] < phase else ((phase, -1, -1), (2.0, 1, 1))
        return _inside_box(np.array(low), np.array(high))(local, turned)

    return _grid(matrix, (8, 4, 4), lambda points: ((points - centre) @ turn)[..., 0] < phase, distance, tile=16)


@pytest.mark.parametrize("phase", [-0.2, 0.0, 0.15])
def test_visibility_kills_the_leak_through_a_thin_wall(phase):
    grid = _two_rooms(phase=phase)
    wall = np.stack([np.full(500, phase + 1e-4), *_points(500, -0.9, 0.9).T[1:]], axis=1)
    towards_dark, towards_light = np.tile([1.0, 0, 0], (500, 1)), np.tile([-1.0, 0, 0], (500, 1))
    leak = ProbeField([grid], lookup=TRILINEAR).irradiance(wall, towards_dark) / np.pi
    assert leak.mean() > 0.15
    field = ProbeField([grid])
    assert (field.irradiance(wall, towards_dark) / np.pi).mean() < 4e-4
    lit = field.irradiance(wall - [2e-4, 0, 0], towards_light) / np.pi
    assert lit.mean() > 0.97


def test_rotation_and_place_of_the_lattice_do_not_matter():
    rotation = sampling.random_rotations(1, np.random.default_rng(2))[0]
    centre = np.array([300.0, -200.0, 50.0])
    local = _points(400, (-2, -1, -1), (2, 1, 1))
    normals = sampling.fibonacci_sphere(400).astype(np.float64)
    for lookup, tolerance in ((TRILINEAR, 2e-5), (LookupSettings(), 0.02)):
        plain = ProbeField([_two_rooms()], lookup=lookup).irradiance(local, normals)
        turned = ProbeField([_two_rooms(rotation, centre)], lookup=lookup).irradiance(local @ rotation.T + centre,
                                                                                      normals @ rotation.T)
        assert np.mean(np.abs(turned - plain)) / np.pi < tolerance


def test_non_uniform_scale_interpolates_in_the_lattice():
    matrix = _matrix((4, 0.5, 2), (1, 2, 3), sampling.random_rotations(1, np.random.default_rng(3))[0])
    grid = _grid(matrix, (5, 2, 3), lambda points: lattice.local_from_world(matrix, points) @ [0.3, 0.2, -0.1] + 1)
    local = _points(200, -0.5, 0.5)
    points = lattice.transform_points(matrix, local)
    value = ProbeField([grid], lookup=TRILINEAR).irradiance(points, sampling.fibonacci_sphere(200))
    assert np.allclose(value, np.pi * (local @ [0.3, 0.2, -0.1] + 1)[:, None], rtol=1e-5)


@pytest.mark.parametrize("reconstruction", RECONSTRUCTIONS)
def test_never_negative_for_random_coefficients(reconstruction):
    rng = np.random.default_rng(4)
    grid = _grid(_matrix(), (3, 3, 3), lambda points: np.ones(points.shape[:3]))
    grid = replace(grid, sh=rng.normal(size=grid.sh.shape).astype(np.float32))
    value = ProbeField([grid], lookup=LookupSettings(reconstruction)).irradiance(_points(2000, -1.2, 1.2),
                                                                                 sampling.fibonacci_sphere(2000))
    assert np.all(np.isfinite(value)) and value.min() >= 0 and value.max() > 0


def test_invalid_probes_are_ignored_whatever_they_hold():
    grid = _grid(_matrix(), (2, 2, 2), lambda points: np.ones(points.shape[:3]))
    bad = {name: getattr(grid, name).copy() for name in ("sh", "validity", "visibility")}
    bad["validity"][0, 1, 0] = 0.3
    bad["sh"][0, 1, 0] = np.nan
    bad["visibility"][0, 1, 0] = np.nan
    field = ProbeField([replace(grid, **bad)])
    corner = lattice.lattice_points(np.eye(4), (2, 2, 2))[0, 1, 0]
    points = np.concatenate([_points(200, -1, 1), [corner]])
    assert np.allclose(field.irradiance(points, sampling.fibonacci_sphere(201)), np.pi, rtol=1e-5)


def test_moved_probes_count_and_are_weighed_from_where_they_are():
    grid = _grid(_matrix(), (2, 1, 1), lambda points: (points[..., 0] > 0) * 1.0)
    validity, offset = grid.validity.copy(), grid.offset_world.copy()
    validity[0, 0, 1] = 0.0
    offset[0, 0, 1] = [0, 0, 0.8]
    moved = ProbeField([replace(grid, validity=validity, offset_world=offset)], lookup=LookupSettings(visibility=False))
    point = np.array([[0.0, 0, 0]])
    up, down = (moved.irradiance(point, np.array([[0.0, 0, z]]))[0, 0] / np.pi for z in (1, -1))
    # Weights: the probe at rest (½)² + 0.2 = 0.45; the moved one, at cosine ±0.8/√(0.25 + 0.64), 1.05 or 0.2058.
    cosine = 0.8 / np.sqrt(0.89)
    above, below = ((1 + cosine) / 2) ** 2 + 0.2, ((1 - cosine) / 2) ** 2 + 0.2
    assert up == pytest.approx(above / (above + 0.45), rel=1e-3)
    assert down == pytest.approx(below / (below + 0.45), rel=1e-3)


def test_unseen_points_fall_back_to_the_trilinear_answer():
    grid = _grid(_matrix(), (2, 1, 1), lambda points: points[..., 0] + 1,
                 lambda point, directions: np.full(len(directions), 1e-3))
    points, normals = np.array([[-0.25, 0, 0.0]]), np.array([[0.0, 0, 1]])
    hidden = ProbeField([grid]).irradiance(points, normals)
    assert np.allclose(hidden, ProbeField([grid], lookup=TRILINEAR).irradiance(points, normals), rtol=1e-3)


def test_dilation_fills_from_the_nearest_live_probes():
    grid = _grid(_matrix((1, 2, 3)), (5, 4, 3), lambda points: points[..., 0])
    validity = np.zeros_like(grid.validity)
    validity[1, 1, 0], validity[2, 3, 4] = 1.0, 0.8
    sparse = replace(grid, validity=validity, sh=np.where(validity[..., None, None] > 0, grid.sh, np.nan))
    filled = dilate(sparse)
    assert np.all(np.isfinite(filled.sh)) and filled.validity is sparse.validity
    live = live_probes(sparse)
    assert live.sum() == 2 and np.array_equal(filled.sh[live], grid.sh[live])
    assert np.allclose(filled.sh[0, 0, 1], grid.sh[1, 1, 0]) and np.allclose(filled.sh[2, 2, 3], grid.sh[2, 3, 4])
    values = filled.sh[..., 0, 0] / UNIT_L0
    assert values.min() >= -0.8 - 1e-5 and values.max() <= 0.8 + 1e-5


def test_dilation_weights_by_inverse_square_distance():
    grid = _grid(_matrix((3, 2, 1)), (3, 2, 1), lambda points: 1 + points[..., 0] + 10 * points[..., 1])
    validity = np.ones_like(grid.validity)
    validity[0, 0, 1] = 0
    filled = dilate(replace(grid, validity=validity))
    points = lattice.lattice_points(grid.volume.world_from_local, (3, 2, 1)).reshape(-1, 3)
    others = np.array([0, 2, 3, 4, 5])
    weights = 1 / np.sum((points[others] - points[1]) ** 2, axis=1)
    expected = np.sum(weights * grid.sh.reshape(6, 9, 3)[others, 0, 0]) / weights.sum()
    assert filled.sh[0, 0, 1, 0, 0] == pytest.approx(expected, rel=1e-5)


def test_dilation_without_live_probes_changes_nothing():
    grid = _grid(_matrix(), (2, 2, 2), lambda points: np.ones(points.shape[:3]))
    dead = replace(grid, validity=np.zeros_like(grid.validity))
    assert dilate(dead) is dead and dilate(grid) is grid
    assert np.allclose(ProbeField([dead]).irradiance(_points(5, -1, 1), sampling.fibonacci_sphere(5)), np.pi, rtol=1e-5)


def test_finest_volume_wins_and_borders_blend_continuously():
    outer = _grid(_matrix((4, 4, 4)), (4, 4, 4), lambda points: np.ones(points.shape[:3]), name="Outer")
    inner = _grid(_matrix((1, 1, 1)), (4, 4, 4), lambda points: np.full(points.shape[:3], 3.0), name="Inner")
    apart = _grid(_matrix((1, 1, 1), (12, 0, 0)), (2, 2, 2), lambda points: np.full(points.shape[:3], 9.0), name="Apart")
    x = np.linspace(-6, 14, 4001)
    points = np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1)
    value = ProbeField([outer, apart, inner]).irradiance(points, np.tile([0.0, 0, 1], (len(x), 1)))[:, 0] / np.pi
    assert np.allclose(value[np.abs(x) < 0.5], 3, rtol=1e-5)
    assert np.allclose(value[(np.abs(x) > 1) & (x < 7)], 1, rtol=1e-5)
    assert np.interp(0.75, x, value) == pytest.approx(2, rel=1e-3)
    # Outside everything the nearest volume answers: halfway between 4 and 11 the answer changes hands.
    assert np.allclose(value[(x > 4) & (x < 7.49)], 1, rtol=1e-5) and np.allclose(value[x > 7.51], 9, rtol=1e-5)
    steps = np.abs(np.diff(value))
    assert steps[x[1:] < 7].max() < 0.05


def test_overlapping_volumes_without_a_common_parent_stay_continuous():
    left = _grid(_matrix((2, 1, 1), (-1.2, 0, 0)), (4, 2, 2), lambda points: np.ones(points.shape[:3]))
    right = _grid(_matrix((2, 1, 1), (1.2, 0, 0)), (8, 2, 2), lambda points: np.full(points.shape[:3], 2.0))
    x = np.linspace(-3, 3, 3001)
    points = np.stack([x, np.full_like(x, 0.1), np.zeros_like(x)], axis=1)
    value = ProbeField([left, right]).irradiance(points, np.tile([0.0, 0, 1], (len(x), 1)))[:, 0] / np.pi
    assert value[0] == pytest.approx(1, rel=1e-5) and value[-1] == pytest.approx(2, rel=1e-5)
    assert np.abs(np.diff(value)).max() < 0.02


def test_arrays_round_trip():
    volume_settings = {"order": 1}
    grid = _grid(_matrix((1, 2, 3), (4, 5, 6)), (2, 3, 2), lambda points: points[..., 2], name="Häll")
    grid = replace(grid, volume=replace(grid.volume, settings=volume_settings, fitted=True))
    field = ProbeField([grid, grid], direct_lamps=frozenset({"lamp"}), params={"rays": 64}, stats={"rays": 1},
                       lookup=LookupSettings("geomerics", visibility=False))
    again = ProbeField.from_arrays(field.arrays(), direct_lamps=frozenset({"lamp"}), params=field.params, stats=field.stats)
    assert again.lookup == field.lookup and again.params == field.params and len(again.grids()) == 2
    volume = again.grids()[0].volume
    assert (volume.name, volume.resolution, volume.fitted, volume.settings) == ("Häll", (2, 3, 2), True, volume_settings)
    points, normals = _points(30, 0, 8), sampling.fibonacci_sphere(30)
    assert np.array_equal(again.irradiance(points, normals), field.irradiance(points, normals))
    assert again.with_lookup(TRILINEAR).params["lookup"]["visibility"] is False


def test_a_point_at_a_probe_is_finite_without_bias():
    grid = _grid(_matrix(), (2, 2, 2), lambda points: np.ones(points.shape[:3]))
    points = lattice.lattice_points(np.eye(4), (2, 2, 2)).reshape(-1, 3)
    value = ProbeField([grid], lookup=LookupSettings(normal_bias=0.0)).irradiance(points, sampling.fibonacci_sphere(8))
    assert np.allclose(value, np.pi, rtol=1e-5)


def test_wrong_use_is_refused():
    with pytest.raises(ValueError, match="reconstruction"):
        LookupSettings("cubic")
    with pytest.raises(ValueError, match="at least one grid"):
        ProbeField([])


def test_no_points_give_no_irradiance():
    grid = _grid(_matrix(), (2, 2, 2), lambda points: np.ones(points.shape[:3]))
    assert ProbeField([grid]).irradiance(np.empty((0, 3)), np.empty((0, 3))).shape == (0, 3)


def test_a_surface_on_a_plane_of_probes_reads_the_layer_in_front_of_it():
    """A sheet without thickness at z = 0 with probes on it, all of which stand aside on its upper side."""
    def distance(point, directions):
        with np.errstate(divide="ignore"):
            sheet = -point[2] / directions[:, 2]
        return np.minimum(_inside_box(-2.0, 2.0)(point, directions), np.where(sheet > 0, sheet, np.inf))

    aside = 0.05
    grid = _grid(_matrix((1.5, 1.5, 1.5)), (3, 3, 3), lambda points: np.where(points[..., 2] >= 0, 9.0, 1.0),
                 lambda point, directions: distance(point + np.array([0, 0, aside * (point[2] == 0)]), directions))
    offset = grid.offset_world.copy()
    offset[1, :, :, 2] = aside
    points = np.stack([*_points(200, -1, 1).T[:2], np.zeros(200)], axis=1)
    field = ProbeField([replace(grid, offset_world=offset)])
    below = field.irradiance(points, np.tile([0.0, 0, -1], (200, 1))) / np.pi
    # Probes this near see along the sheet hardly knowing which side of it; without the lift they are all there is, and this is 9.
    assert below.mean() < 2.5
    above = field.irradiance(points, np.tile([0.0, 0, 1], (200, 1))) / np.pi
    assert np.abs(above - 9.0).max() < 0.05


def test_what_a_probe_sees_beyond_a_point_is_the_share_of_its_distribution():
    """Between two distances seen half and half it falls from nearly all to nearly nothing, and is half at their mean."""
    near, far = 0.5, 1.5
    mean, square = 0.5 * (near + far), 0.5 * (near**2 + far**2)
    distance = np.array([0.0, near, 1.0, far, 10.0])
    share = np.sqrt(seen_share(distance, mean, square))
    assert share[2] == pytest.approx(0.5) and np.all(np.diff(share) < 0)
    assert share[1] == pytest.approx(0.5 + 0.5 / np.sqrt(2.0)) and share[1] + share[3] == pytest.approx(1.0)
    assert share[4] < 0.01
    # A wall that is seen at one distance hides all beyond it and nothing before it.
    assert np.allclose(seen_share(np.array([0.9, 1.1]), 1.0, 1.0 + 1e-8), [1.0, 0.0], atol=1e-5)
