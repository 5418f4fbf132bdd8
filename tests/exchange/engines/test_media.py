"""Media as engines march them: the march beside what rays pass exactly, its light by closed forms, and what the kit notices."""

from dataclasses import replace

import numpy as np
import pytest
from media_bundles import box, even_light, fog, media_bundle, smoke

from rtgi_addon.exchange.engines.axes import UNREAL, Y_UP
from rtgi_addon.exchange.engines.media import engine_media, slice_share
from rtgi_addon.exchange.engines.media_conformance import kit_media, to_json
from rtgi_addon.exchange.engines.volumes import engine_field
from rtgi_addon.scene import Phase
from rtgi_addon.transport.media.table import MediaTable


def made(*media, axes=Y_UP, light=1.0):
    bundle = media_bundle(*media, grids=even_light(light))
    return engine_media(bundle.media, engine_field(bundle), axes)


def rays(count=100):
    rng = np.random.default_rng(5)
    origins, directions = rng.uniform(-2, 2, (count, 3)), rng.normal(size=(count, 3))
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True), rng.uniform(1.0, 6.0, count)


@pytest.mark.parametrize("axes", [Y_UP, UNREAL], ids=["metres", "centimetres"])
def test_the_march_takes_and_gives_what_a_ray_passes(axes):
    """Of absorbing, glowing media: no light is scattered."""
    media = tuple(replace(medium, scattering=np.zeros(3)) for medium in (fog(0.1, 0.2), box(), smoke()))
    origins, directions, lengths = rays()
    table = MediaTable(media)
    left, gained = made(*media, axes=axes).march(axes.vectors(origins), axes.directions(directions), lengths * axes.scale, 400)
    assert np.abs(left - table.transmittance(origins, directions, lengths)).max() < 4e-3
    assert np.abs(gained - table.emitted(origins, directions, lengths)).max() < 4e-3


def test_a_medium_that_only_scatters_is_not_seen_in_even_light():
    for phase in (Phase(), Phase(anisotropy=0.7), Phase("RAYLEIGH"), Phase("MIE")):
        white = replace(fog(0.3), scattering=np.full(3, 0.3), absorption=np.zeros(3), phase=phase)
        left, gained = made(white).march(*rays(), 7)
        assert np.allclose(left + gained, 1.0, atol=1e-3)


def test_light_from_one_side_is_scattered_by_the_moments():
    """L = 1 + z: along z a medium of g shows 1 + g, against it 1 - g."""
    grids = even_light(1.0)
    grids[0].sh[..., 2, :] = np.sqrt(4.0 * np.pi / 3.0)
    white = replace(fog(1.0), scattering=np.ones(3), absorption=np.zeros(3), phase=Phase(anisotropy=0.4))
    bundle = media_bundle(white, grids=grids)
    media = engine_media(bundle.media, engine_field(bundle), Y_UP)
    directions = Y_UP.directions(np.array([[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]]))
    _, given = media.source(np.zeros((3, 3)), directions)
    assert given[:, 0] == pytest.approx([1.4, 0.6, 1.0], rel=2e-3)


def test_a_march_keeps_to_the_boxes_where_nothing_is_everywhere():
    media = made(box())
    first, length = media.span(np.array([[1.0, 0.0, 20.0], [50.0, 0, 0]]), np.array([[0, 0, -1.0], [0, 1.0, 0]]), np.full(2, 100.0))
    assert first[0] == pytest.approx(19.8) and length == pytest.approx([1.4, 0.0])


def test_slices_meet_where_the_series_ends():
    depth = np.array([0.0, 0.00999, 0.01001, 3.0])
    assert slice_share(depth) == pytest.approx([1.0, 0.9950216, 0.9950116, (1 - np.exp(-3.0)) / 3.0], rel=1e-6)


def test_none_is_none_and_what_cameras_do_not_see_is_left_out():
    assert made(smoke(visible_camera=False)) is None
    notes = made(fog(), smoke(visible_camera=False)).notes
    assert notes == ("medium Smoke is invisible to cameras and left out",)


@pytest.mark.parametrize("change", [
    lambda media: replace(media, scattering=media.scattering[::-1]),
    lambda media: replace(media, ambient=media.ambient[:, :, ::-1]),
    lambda media: replace(media, boxes=tuple(replace(box, cells=box.cells[:, ::-1]) for box in media.boxes)),
    lambda media: replace(media, boxes=tuple(replace(box, moments=box.moments[::-1]) for box in media.boxes))],
    ids=["bands", "light", "cells", "moments"])
def test_the_kit_notices(change):
    cases = to_json(kit_media(Y_UP), Y_UP)["cases"]
    wrong = change(kit_media(Y_UP))
    case = next(case for case in cases if case["name"] == "kit, media at points")
    found = wrong.source(np.array(case["points"]), np.array(case["directions"]))
    off = [np.abs(values - case[key]) / np.array(case[key + "_tolerance"]) for key, values in
           zip(("first", "second"), found, strict=True)]
    assert len(case["points"]) == 200 and max(np.max(values) for values in off) > 5.0
