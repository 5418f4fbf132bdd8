"""Stylized surfaces: bands against their closed forms, what grading and colour bleeding keep, ink that stays where it is."""

from dataclasses import replace

import numpy as np
import pytest
from flat_frames import floor, frame_of, orthographic, sphere

from rtgi_addon.effects import get
from rtgi_addon.effects.stylized.pattern import bayer
from rtgi_addon.effects.stylized.ramps import format_ramp, look_up, parse_ramp, ramp_table
from rtgi_addon.effects.stylized.tone import banded
from rtgi_addon.errors import UsageError
from rtgi_addon.scene import Instance
from rtgi_addon.transport.vectors import luminance

STYLE = get("stylized")
# Nothing but what a test asks for.
PLAIN = {"shading": "as_lit", "highlights": "as_lit", "lines": False}
SIZE = (480, 480)


def applied(frame, **settings):
    return STYLE.apply(frame, None, STYLE.Settings(**{**PLAIN, **settings}))


def test_style_off_is_the_input_bit_for_bit():
    frame = sphere((64, 64), direct=lambda normal: 3 * normal[..., 2])
    for settings in ({}, {"strength": 0.0, "shading": "bands", "lines": True, "contrast": 2.0},
                     {"pattern": "hatching", "pattern_strength": 0.0}, {"lines": True, "line_opacity": 0.0}):
        assert np.array_equal(applied(frame, **settings), frame.light)


@pytest.mark.parametrize("cosine", [0.2, 0.3, 0.5, 0.9, 0.95])
def test_the_rim_of_a_ball_has_the_area_of_its_cosine_squared(cosine):
    frame = sphere(SIZE)
    found = applied(frame, rim_strength=1.0, rim_width=cosine, rim_softness=0.0) - frame.light
    seen = frame.gbuffer.seen
    assert abs(found[seen][:, 0].mean() - cosine**2) < 2e-3 and not found[~seen].any()


def test_the_rim_by_light_is_on_the_lamps_side_in_whatever_else_there_is():
    towards = np.array([1.0, 0.0, 0.0])
    for irradiance in (0.0, 10.0):
        frame = sphere(SIZE, irradiance=irradiance, direct=lambda normal: np.pi * np.maximum(normal @ towards, 0.0))
        found = applied(frame, rim_strength=1.0, rim_width=0.5, rim_softness=0.0, rim_light=1.0, key=np.pi) - frame.light
        normal = frame.gbuffer.normal[..., :3]
        inside = frame.gbuffer.seen & (normal[..., 2] < 0.49)
        assert np.abs(found[inside][:, 0] - np.maximum(normal[inside][:, 0], 0.0)).max() < 1e-4 and found[inside].max() > 0.9


@pytest.mark.parametrize("angle", [0.0, 30.0, 60.0, 90.0, 135.0])
def test_the_lit_share_of_a_ball_is_that_of_the_moon(angle):
    towards = np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))
    frame = sphere(SIZE, irradiance=0.0, albedo=1.0, direct=lambda normal: np.where(normal @ towards > 0, np.pi, 0.0))
    found = applied(frame, shading="bands", bands=2, key=np.pi, softness=0.0)
    lit = found[frame.gbuffer.seen][:, 0] > 0.5
    assert abs(lit.mean() - (1 + np.cos(np.radians(angle))) / 2) < 2e-3


@pytest.mark.parametrize(("bands", "mean"), [(2, 0.625), (3, 0.648), (4, 0.656)])
def test_bands_of_a_ball_lit_from_the_eye_have_the_areas_and_the_mean_of_their_rings(bands, mean):
    frame = sphere(SIZE, irradiance=0.0, albedo=1.0, direct=lambda normal: np.pi * normal[..., 2])
    found = applied(frame, shading="bands", bands=bands, key=np.pi, softness=0.0)[frame.gbuffer.seen][:, 0]
    for tread in range(bands):
        ring = ((tread + 1) / bands) ** 2 - (tread / bands) ** 2
        assert abs(np.mean(np.abs(found - (tread + 0.5) / bands) < 1e-4) - ring) < 3e-3
    # The lit ball's own mean is 2/3; treads at the lower end of their bands would be as dark as 0.375.
    assert abs(found.mean() - mean) < 2e-3 and abs(frame.light[frame.gbuffer.seen][:, 0].mean() - 2 / 3) < 2e-3


@pytest.mark.parametrize("bands", [1, 2, 3, 5, 16])
def test_bands_are_idempotent_ascending_and_soft_no_further_than_asked(bands):
    tone = np.linspace(-0.2, 1.4137, 4001, dtype=np.float32)
    hard = banded(tone, bands, 0.0)
    assert np.array_equal(banded(hard, bands, 0.0), hard) and len(np.unique(hard)) == bands
    soft = banded(tone, bands, 0.02)
    assert np.allclose(banded(hard, bands, 0.02), hard, atol=1e-6) and np.all(np.diff(soft) >= -1e-7)
    borders = np.arange(1, bands) / bands
    away = np.abs(tone[:, None] - borders).min(axis=1) if bands > 1 else np.ones_like(tone)
    # Half a step to either side, and nothing beyond.
    assert np.allclose(soft[away > 0.0101], hard[away > 0.0101], atol=1e-6)


def test_steps_are_as_many_pixels_wide_as_asked():
    width = 400
    seen = np.ones((8, width), bool)
    position = np.zeros((8, width, 3))
    ramp = np.broadcast_to(np.linspace(0, 1, width), seen.shape)
    frame = frame_of(orthographic((width, 8)), position, np.broadcast_to([0.0, 0, 1], position.shape), seen, albedo=1.0,
                     irradiance=ramp * np.pi)
    for pixels in (2, 8, 20):
        row = applied(frame, shading="bands", bands=2, key=np.pi, softness=pixels)[4, :, 0]
        between = np.count_nonzero((row > 0.2501) & (row < 0.7499))
        assert abs(between - pixels) <= 1
    assert np.allclose(row, row.clip(0.25, 0.75), atol=1e-6)


def test_bands_keep_the_hue_of_the_light_that_stands_around():
    frame = sphere((96, 96), irradiance=0.0)
    red = frame.irradiance.copy()
    red[..., :3] = np.float32([1.2, 0.3, 0.15])
    frame = replace(frame, irradiance=red).lit()
    found = applied(frame, shading="bands", bands=4)[frame.gbuffer.seen][:, :3]
    assert np.allclose(found / luminance(found)[:, None], np.float32([1.2, 0.3, 0.15]) / luminance(np.float32([1.2, 0.3, 0.15])),
                       atol=1e-4)
    apart = applied(frame, shading="bands", bands=4, per_channel=True)[frame.gbuffer.seen][0, :3] * 2
    assert np.allclose(apart, [0.375, 0.125, 0.125], atol=1e-3)


def test_colour_bleeding_leaves_luminance_and_direct_light_alone():
    frame = sphere((64, 64), direct=lambda normal: normal[..., 2])
    coloured = frame.irradiance.copy()
    coloured[..., :3] = np.float32([0.6, 0.5, 0.4])
    frame = replace(frame, irradiance=coloured).lit()
    for amount in (0.0, 0.5, 2.0):
        found = applied(frame, bleeding=amount)
        assert np.allclose(luminance(found[..., :3]), luminance(frame.light[..., :3]), atol=1e-5)
        spread = (found - frame.light)[frame.gbuffer.seen][:, :3]
        expected = (amount - 1) * (np.float32([0.6, 0.5, 0.4]) - luminance(np.float32([0.6, 0.5, 0.4]))) * 0.5 / np.pi
        assert np.allclose(spread, expected, atol=1e-5)


def test_a_shine_is_parted_from_what_lies_below():
    from rtgi_addon.effects.stylized.shading import _parted
    generator = np.random.default_rng(4)
    albedo, colour = generator.random((2, 500, 3)).astype(np.float32)
    colour /= luminance(colour)[:, None]
    arriving, shine = generator.random((2, 500)).astype(np.float32)
    shine[:100], albedo[100:150] = 0.0, 0.0
    direct = np.concatenate([colour * (albedo * arriving[:, None] / np.pi + shine[:, None]), arriving[:, None]], axis=1)
    found_colour, found_shine = _parted(albedo, direct.astype(np.float32))
    assert np.allclose(found_shine, shine, atol=2e-3)
    bright = luminance(direct[:, :3]) > 0.02
    assert np.allclose(found_colour[bright], colour[bright], rtol=0.02)
    assert not np.any(_parted(albedo[:1], np.zeros((1, 4), np.float32))[0])


def test_highlights_are_flat_spots_of_the_brightness_asked_for():
    frame = sphere((128, 128), irradiance=0.0, albedo=0.2, direct=lambda normal: 2 * normal[..., 2])
    shiny = frame.direct.copy()
    spot = frame.gbuffer.normal[..., 2] ** 200 * 4
    shiny[..., :3] += spot[..., None]
    frame = replace(frame, direct=shiny).lit()
    none = applied(frame, highlights="none")
    band = applied(frame, highlights="band", highlight_threshold=0.5, highlight_brightness=0.7, highlight_softness=0.0)
    shown = (band - none)[..., 0]
    assert np.allclose(shown[spot > 0.55], 0.7, atol=0.01) and np.allclose(shown[spot < 0.45], 0.0, atol=0.01)
    ramp = applied(frame, highlights="ramp", highlight_threshold=0.5, highlight_ramp="constant 0:0 0.5:0.25 1:1",
                   highlight_brightness=0.8) - none
    assert np.allclose(ramp[..., 0][(spot > 0.3) & (spot < 0.45)], 0.2, atol=0.01)


def test_grading_turns_about_middle_grey_and_keeps_luminance():
    frame = sphere((32, 32), albedo=0.6, irradiance=2.0)
    grey = frame.light.copy()
    grey[..., :3] = 0.18
    assert np.allclose(applied(replace(frame, light=grey), contrast=3.0)[..., :3], 0.18, atol=1e-6)
    coloured = frame.light.copy()
    coloured[..., :3] = np.float32([0.4, 0.2, 0.1])
    graded = applied(replace(frame, light=coloured), saturation=0.3)
    assert np.allclose(luminance(graded[..., :3]), luminance(coloured[..., :3]), atol=1e-6)
    assert np.ptp(graded[0, 0, :3]) < 0.1
    tinted = applied(replace(frame, light=coloured), tint=(0.5, 1.0, 2.0))
    assert np.allclose(tinted[..., :3], coloured[..., :3] * [0.5, 1.0, 2.0])


def test_ramps_are_read_written_and_refused():
    assert parse_ramp("") == ([0.0, 1.0], pytest.approx(np.array([[0.0] * 3, [1.0] * 3])), False)
    text = "constant 0:0.1,0.1,0.3 0.5:0.6,0.5,0.5 1:1,1,1"
    positions, colours, constant = parse_ramp(text)
    assert constant and format_ramp(positions, colours, constant) == text
    table = ramp_table(text)
    assert np.allclose(look_up(table, np.float32([0.0, 0.4, 0.6, 1.0, 7.0])),
                       [[0.1, 0.1, 0.3], [0.1, 0.1, 0.3], [0.6, 0.5, 0.5], [1, 1, 1], [1, 1, 1]])
    tones = np.linspace(0, 1, 101, dtype=np.float32)
    assert np.allclose(look_up(ramp_table("0:0 1:1"), tones), tones[:, None], atol=1e-6)
    for wrong in ("red", "0.5", "2:1,1,1", "0:1,1", "0:nan,0,0"):
        with pytest.raises(UsageError, match="no stop of a ramp"):
            ramp_table(wrong)


def test_a_ramp_colours_tones_and_the_light_tints_it():
    frame = sphere((64, 64), irradiance=0.5 * np.pi, albedo=1.0)
    found = applied(frame, shading="ramp", ramp="0:0,0,0.4 1:1,0.6,0", key=np.pi)[frame.gbuffer.seen][:, :3]
    assert np.allclose(found, [0.5, 0.3, 0.2], atol=0.01)


def test_bayers_thresholds_are_every_64th_once():
    assert np.allclose(np.sort(bayer().ravel()), (np.arange(64) + 0.5) / 64)
    for tone in np.linspace(0, 1, 41):
        assert abs(np.mean(tone > bayer()) - tone) <= 1 / 128 + 1e-6


@pytest.mark.parametrize("darkness", [0.0, 0.15, 0.4, 0.5, 0.7, 0.95])
@pytest.mark.parametrize("pattern", ["stipple", "hatching"])
def test_ink_covers_what_the_tone_asks_for(pattern, darkness):
    size = 512
    seen = np.ones((size, size), bool)
    grid = (np.indices(seen.shape) + 0.5) * 2 / size - 1
    position = np.dstack([grid[1], grid[0], np.zeros(seen.shape)])
    normal = np.broadcast_to([0.0, 0.0, 1.0], position.shape)
    frame = frame_of(orthographic((size, size)), position, normal, seen, irradiance=(1 - darkness) * np.pi)
    inked = applied(frame, pattern=pattern, pattern_spacing=8, key=np.pi, pattern_color=(5.0, 5.0, 5.0))
    share = (inked[..., 0] - frame.light[..., 0]) / (5.0 - frame.light[..., 0])
    assert abs(share.mean() - darkness) < 0.02


def test_ink_stays_on_an_object_that_moves():
    def at(shift, turn):
        size = 200
        seen = np.ones((size, size), bool)
        grid = (np.indices(seen.shape) + 0.5) * 2 / size - 1
        local = np.dstack([grid[1], grid[0], np.zeros(seen.shape)])
        placed = np.eye(4)
        placed[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        placed[:3, 3] = shift
        position = local @ placed[:3, :3].T + placed[:3, 3]
        normal = np.broadcast_to([0.0, 0.0, 1.0], position.shape)
        return frame_of(orthographic((size, size)), position, normal, seen, irradiance=0.4 * np.pi,
                        instances=(Instance("sheet", 0, placed),))
    first = applied(at((0, 0, 0), 0.0), pattern="hatching", key=np.pi)
    moved = applied(at((3.1, -2.7, 0.0), 0.7), pattern="hatching", key=np.pi)
    assert np.ptp(first[..., 0]) > 0.1 and np.mean(np.abs(first - moved) > 0.02) < 0.01


def test_paper_is_paper_everywhere_and_opaque():
    frame = replace(floor((40, 30)), transparent=True).lit()
    found = applied(frame, shading="paper", paper_background=True, paper_color=(0.1, 0.2, 0.3))
    assert np.allclose(found, [0.1, 0.2, 0.3, 1.0], atol=1e-6)


def test_styles_are_gone_where_mist_leaves_nothing():
    frame = sphere((96, 96), direct=lambda normal: 3 * normal[..., 2])
    mist = get("mist")
    frame = replace(frame, light=mist.apply(frame, None, mist.Settings(start=0.0, depth=1.0, fade_to="color")))
    assert np.allclose(frame.light, [0.5, 0.6, 0.7, 1.0])
    for settings in ({"shading": "bands"}, {"pattern": "hatching"}, {"lines": True}, {"rim_strength": 1.0}):
        assert np.abs(applied(frame, **settings) - frame.light).max() < 1e-6
        assert np.abs(applied(replace(frame, passes={}), **settings) - frame.light).max() > 0.02
