"""Lines of the stylized effect: none where planes are, all where things end, as long and as wide as geometry says."""

from dataclasses import replace

import numpy as np
import pytest
from flat_frames import floor, frame_of, orthographic, sphere

from rtgi_addon.effects import get
from rtgi_addon.effects.stylized.edges import depth_step, find_borders
from rtgi_addon.effects.stylized.strokes import draw_lines, offsets
from rtgi_addon.scene import Instance

STYLE = get("stylized")
NONE = {"depth_edges": "none", "normal_edges": "none", "object_edges": False, "material_edges": False, "marked_edges": False}


def borders(frame, **settings):
    values = STYLE.parameters(STYLE.Settings(**settings), frame.scene)
    return find_borders(frame, values), values


def count(found):
    """How many borders of pixels have a line."""
    return sum(np.count_nonzero(part.half_width) for part in found)


def lines(frame, **settings):
    found, values = borders(frame, **settings)
    return draw_lines(found, values["line_widest"])


@pytest.mark.parametrize("spin", [0.0, 0.4, np.pi / 2])
@pytest.mark.parametrize("mode", ["plane", "inverse_depth"])
def test_a_plane_to_the_horizon_has_no_line_in_it(mode, spin):
    frame = floor((320, 180), spin=spin)
    found, _ = borders(frame, **{**NONE, "depth_edges": mode, "depth_threshold": 0.5})
    assert frame.gbuffer.seen.mean() > 0.4 and count(found) == 0
    # While a pixel's step of depth there is metres, which is what the gradient takes for lines.
    gradient, _ = borders(frame, **{**NONE, "depth_edges": "gradient"})
    assert max(depth_step(frame, 2, axis).max() for axis in (0, 1)) > 5.0 and count(gradient) > 500


@pytest.mark.parametrize("radius", [40, 90])
def test_a_ball_has_a_line_of_the_length_of_a_digital_circle(radius):
    size = 256
    found, _ = borders(sphere((size, size), radius=2 * radius / size), depth_edges="none")
    assert abs(count(found) / (8 * radius) - 1) < 0.02


def test_a_smooth_ball_has_no_lines_within_its_contour():
    # Next to the limb a pixel's step in depth is √(2r) pixels, and yet only one pixel from the other's plane.
    for size in (101, 256, 400):
        found, _ = borders(sphere((size, size)), **{**NONE, "depth_edges": "plane", "depth_threshold": 1.5})
        assert count(found) == 0


@pytest.mark.parametrize("width", [1.0, 1.5, 2.0, 3.0, 6.5])
def test_a_line_covers_its_width_times_its_length(width):
    size, radius = 256, 80
    found = lines(sphere((size, size), radius=2 * radius / size), line_width=width)
    assert abs(found.coverage.sum() / (2 * np.pi * radius * width) - 1) < 0.12
    seen = np.zeros((64, 64), bool)
    seen[:, 20:] = True
    zero = np.zeros((64, 64, 3))
    edge = frame_of(orthographic((64, 64)), zero, zero + np.array([0, 0, 1]), seen)
    assert np.allclose(lines(edge, line_width=width).coverage.sum(axis=1)[10:-10], width, atol=1e-5)


def test_lines_turn_with_the_picture():
    frame = sphere((96, 96), radius=0.6, centre=(0.2, -0.1))
    turned = sphere((96, 96), radius=0.6, centre=(0.1, 0.2))
    found = lines(frame, line_width=2.5).coverage
    assert found.any() and np.allclose(np.rot90(found, -1), lines(turned, line_width=2.5).coverage, atol=1e-6)


def stairs(size, scale=1.0):
    """Two flat steps of one object, one above the other by 20 pixels' widths, and a third by 1."""
    width, height = size
    view = orthographic(size, 2.0 * scale)
    pixel = 2.0 * scale / height
    x = (np.arange(width) + 0.5 - width / 2) * pixel
    y = (np.arange(height) + 0.5 - height / 2) * pixel
    z = np.select([x < -0.3 * scale, x < 0.3 * scale], [0.0, 0.2 * scale], 0.202 * scale)
    position = np.dstack([*np.broadcast_arrays(x[None, :], y[:, None], z[None, :])])
    return frame_of(view, position, np.broadcast_to([0.0, 0.0, 1.0], position.shape), np.ones((height, width), bool))


@pytest.mark.parametrize("mode", ["plane", "inverse_depth", "gradient"])
def test_steps_in_depth_have_lines_whatever_the_scale(mode):
    for scale in (0.01, 1.0, 300.0):
        frame = stairs((120, 100), scale)
        found, _ = borders(frame, **{**NONE, "depth_edges": mode})
        assert count(found) == 100 and np.all(found[0].half_width[:, 44] > 0)


def test_twice_the_resolution_has_lines_of_the_same_length():
    def length(size):
        found, _ = borders(sphere((size, size), radius=0.61, centre=(0.03, 0.02)))
        return count(found) / size
    assert abs(length(400) / length(200) - 1) < 0.02


def wedge(angle, size=80):
    """A roof whose sides' normals differ by ``angle`` degrees, of one object and one material."""
    half = np.radians(angle) / 2
    grid = (np.arange(size) + 0.5) * 2 / size - 1
    x, y = np.meshgrid(grid, grid)
    normal = np.dstack([np.sign(x) * np.sin(half), np.zeros_like(x), np.full_like(x, np.cos(half))])
    position = np.dstack([x, y, -np.abs(x) * np.tan(half)])
    return frame_of(orthographic((size, size)), position, normal, np.ones(x.shape, bool))


def test_creases_have_lines_from_their_angle_on():
    for angle, expected in ((40, 0), (50, 80), (120, 80)):
        found, _ = borders(wedge(angle), **{**NONE, "normal_edges": "angle", "crease_angle": 45.0})
        assert count(found) == expected
        by_component, _ = borders(wedge(angle), **{**NONE, "normal_edges": "components",
                                                    "normal_threshold": 2 * np.sin(np.radians(45 / 2))})
        assert count(by_component) == expected
    # Ridges bulge and valleys are hollow.
    for mode, expected in (("ridges", True), ("valleys", False), ("both", True)):
        found, _ = borders(wedge(60), **{**NONE, "curvature_edges": mode})
        assert (count(found) > 0) == expected
        hollow = wedge(60)
        hollow.gbuffer.normal[..., 0] *= -1
        found, _ = borders(hollow, **{**NONE, "curvature_edges": mode})
        assert (count(found) > 0) == (mode != "ridges")


def rounded(radius, spin=0.0, size=81, noise=0.0, skew=0.0):
    """A right-angled edge through the middle of the picture, rounded over ``radius`` pixels, its normals off by ``noise``; with
    ``skew`` it bends more on one side."""
    grid = np.arange(size) + 0.5 - size / 2
    x, y = np.meshgrid(grid, grid)
    along = np.array([np.cos(spin), np.sin(spin)])
    share = np.clip((x * along[0] + y * along[1]) / radius, -np.sqrt(0.5), np.sqrt(0.5))
    share = share + skew * (0.5 - share**2)
    share = share + noise * np.random.default_rng(0).normal(size=share.shape)
    normal = np.dstack([share * along[0], share * along[1], np.sqrt(1 - share**2)])
    return frame_of(orthographic((size, size)), np.dstack([x, y, 0 * x]), normal, np.ones(x.shape, bool))


RIDGES = {**NONE, "curvature_edges": "ridges", "curvature_threshold": 4.0}


@pytest.mark.parametrize("noise", [0.0, 1e-5])
@pytest.mark.parametrize("radius", [2.0, 5.0, 12.0])
def test_a_rounded_edge_has_one_line_along_its_middle(radius, noise):
    for spin, axis in ((0.0, 0), (np.pi / 2, 1), (0.3, 0), (1.2, 1)):
        found, _ = borders(rounded(radius, spin, noise=noise), **RIDGES)
        drawn = found[axis].half_width[20:-20, 20:-20] > 0
        drawn = drawn if axis == 0 else drawn.T
        assert np.all(drawn.sum(axis=1) == 1)
        # The border lies half a pixel behind its first pixel; a picture of odd size has a middle pixel.
        middle = np.argmax(drawn, axis=1) + 20.5 - 40
        offset = (np.arange(20, 61) - 40) * (-np.tan(spin) if axis == 0 else -1 / np.tan(spin))
        assert np.abs(middle - offset).max() <= 1.01 and count([found[1 - axis]]) == 0


def test_a_diagonal_ridge_has_a_line_without_gaps():
    found, values = borders(rounded(6.0, np.pi / 4), **RIDGES, line_width=1.0)
    coverage = draw_lines(found, values["line_widest"]).coverage[20:-20, 20:-20]
    assert np.all(coverage.max(axis=1) > 0.2) and np.all((coverage > 0.0).sum(axis=1) <= 4)


def test_an_uneven_bend_has_its_line_nearer_its_crest():
    even, skewed = (np.argmax(borders(rounded(10.0, skew=skew), **RIDGES)[0][0].half_width[40] > 0) for skew in (0.0, 0.4))
    assert skewed < even


def test_what_bends_both_ways_or_over_long_is_no_ridge():
    ball = sphere((80, 80), radius=0.5)
    assert count(borders(ball, **{**RIDGES, "curvature_threshold": 1.0})[0]) < 0.02 * np.count_nonzero(ball.gbuffer.seen)
    assert count(borders(rounded(60.0), **{**RIDGES, "curvature_threshold": 0.5})[0]) == 0


def halves(**given):
    """Left and right half of a plane."""
    size = 60
    grid = np.zeros((size, size, 3))
    right = np.broadcast_to(np.arange(size) >= size // 2, (size, size)).astype(int)
    return right, lambda **more: frame_of(orthographic((size, size)), grid, grid + np.array([0, 0, 1]), np.ones((size, size), bool),
                                          **{**given, **more})


def test_objects_and_materials_have_borders_in_any_light():
    right, make = halves(materials=2)
    for change, setting in (("instance", "object_edges"), ("material", "material_edges")):
        for light in (0.0, 1.0, 50.0):
            frame = make(**{change: right}, irradiance=light)
            found, _ = borders(frame, **{**NONE, setting: True})
            assert count(found) == 60 and count(borders(frame, **NONE)[0]) == 0


def test_lines_have_the_colour_of_the_nearer_ones_material():
    right, make = halves(materials=2, material=halves()[0], instance=halves()[0])
    frame = make()
    frame.gbuffer.position[..., 2] = right * 0.5
    painted = tuple(replace(item, line_color=color) for item, color in zip(
        frame.scene.materials, ((1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.5)), strict=True))
    frame = replace(frame, scene=replace(frame.scene, materials=painted))
    settings = STYLE.Settings(shading="as_lit", highlights="as_lit", line_width=4.0, line_by_material=True)
    found = STYLE.apply(frame, None, settings)
    assert np.allclose(found[30, 28:32], 0.5 * frame.light[30, 28:32] + [0, 0, 0.5, 0.5], atol=1e-6)
    assert np.array_equal(found[:, :26], frame.light[:, :26])


def test_what_is_excluded_has_no_lines_of_its_own():
    right, make = halves(materials=2)
    frame = make(instance=right)
    frame.gbuffer.position[..., 2] = right * 0.5
    for who, expected in ((0, 60), (1, 0)):
        placed = list(frame.scene.instances)
        placed[who] = Instance("left out", 0, np.eye(4), pass_index=7, collections=("no lines",))
        shown = replace(frame, scene=replace(frame.scene, instances=tuple(placed)))
        assert count(borders(shown, exclude_pass_index=7)[0]) == expected
        assert count(borders(shown, exclude_collection="no lines")[0]) == expected
        assert count(borders(shown, exclude_pass_index=8, exclude_collection="others")[0]) == 60
    materials = tuple(replace(item, pass_index=7) for item in frame.scene.materials)
    assert count(borders(replace(frame, scene=replace(frame.scene, materials=materials)), exclude_pass_index=7)[0]) == 0


def test_widths_are_those_of_the_world_and_thin_with_distance():
    frame = stairs((120, 100))
    pixel = 2.0 / 100
    found, _ = borders(frame, **{**NONE, "depth_edges": "plane"}, line_world_width=5 * pixel)
    assert np.allclose(found[0].half_width[:, 44], 2.5, atol=1e-4)
    # The step is 4.8 m away.
    found, _ = borders(frame, **{**NONE, "depth_edges": "plane"}, line_width=4.0, line_thinning=1.2)
    assert np.allclose(found[0].half_width[:, 44], 0.5, atol=1e-4)
    found, _ = borders(frame, **{**NONE, "depth_edges": "plane"}, line_width=4.0, line_thinning=0.01, line_least=0.8)
    assert np.allclose(found[0].half_width[:, 44], 0.4, atol=1e-4)


def test_every_pixel_within_reach_is_looked_at_once():
    for reach in (1, 2, 4):
        found = offsets(reach)
        assert len(set(found)) == len(found)
        assert {round(entry[3], 3) for entry in found if entry[0] == 1 and entry[2] == 0} == {0.5 + k for k in range(reach + 1)}
