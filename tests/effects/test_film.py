"""The film: means of samples, what their error is thought to be, and where it wants more of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import Chosen, get, picture
from rtgi_addon.effects.base import apply_all
from rtgi_addon.effects.film import _ONE_LOOK, FIRST, Film
from rtgi_addon.effects.frame import Samples
from rtgi_addon.effects.kept_light import KeptLight
from rtgi_addon.effects.lit import draw_frame, draw_samples, light_context
from rtgi_addon.effects.picture import draw_pictures
from rtgi_addon.transport.views.pixel_filter import sample_offset

SHAPE = 12, 16


def exposed(spread, samples=64, seed=0):
    """A film of light 1 with independent noise of standard deviation ``spread`` (h, w)."""
    film, rng = Film(SHAPE[::-1], ("combined",)), np.random.default_rng(seed)
    for index in range(samples):
        if index == samples // 2:
            film.look()
        light = np.ones((*SHAPE, 4))
        light[..., :3] += spread[..., None] * rng.standard_normal((*SHAPE, 3))
        film.add(SimpleNamespace(light=light, index=index, samples=None))
    return film


def test_the_error_is_that_of_the_mean():
    spread = np.full(SHAPE, 0.8)
    film = exposed(spread)
    assert film.error() == pytest.approx(0.8 / np.sqrt(64), rel=0.1)
    off = film.picture("combined")[..., :3] - 1.0
    assert film.error() == pytest.approx(np.sqrt(np.square(off).mean()), rel=0.15)


def test_samples_are_wanted_where_noise_is():
    spread = np.full(SHAPE, 0.001)
    spread[:, 10:] = 1.0
    film = exposed(spread, FIRST)
    needed = film.needing(0.02, 4096)
    # Neighbours of noise count as noisy.
    assert needed[:, 10:].all() and not needed[:, :9].any()
    assert not film.needing(0.02, FIRST).any()


def test_pixels_with_more_samples_count_by_their_own_number():
    film, chosen = exposed(np.zeros(SHAPE), 2), np.zeros(SHAPE, bool)
    chosen[3, 4] = True
    samples = Samples(SHAPE[::-1], np.flatnonzero(np.stack([chosen, chosen])) % chosen.size, np.array([2, 3]), np.zeros((2, 2)))
    film.add(SimpleNamespace(light=np.full((1, 2, 4), 3.0), samples=samples))
    picture = film.picture("combined")
    assert np.all(picture[3, 4, :3] == 2.0) and np.all(picture[~chosen][:, :3] == 1.0)
    assert film.count[3, 4] == 4 and film.count.sum() == 2 * film.count.size + 2


@pytest.fixture(scope="module")
def context():
    """The stage made ready for rays, with its light cache once it was drawn."""
    return light_context(stage(), 1)


def by_rays(scene, error, samples=64, effects=("ray_traced",), threads=1):
    chosen = [Chosen(get(name), get(name).Settings()) for name in effects]
    return draw_pictures(scene, None, view(), SIZE, samples=samples, error=error, effects=chosen, threads=threads)


def test_a_picture_ends_at_its_error_and_says_so(context):
    rough, fine = by_rays(context, 0.2), by_rays(context, 0.012, 64)
    assert rough.error <= 0.2 and rough.samples == FIRST
    assert fine.error <= 0.012 and FIRST < fine.samples < 64
    stopped = by_rays(context, 0.001, 16)
    assert stopped.error > 0.001 and stopped.samples <= 16
    exact = by_rays(context, None, 48).pictures["combined"][..., :3]
    off, level = fine.pictures["combined"][..., :3] - exact, exact.mean()
    assert abs(off.mean()) < 0.01 * level
    assert np.sqrt(np.square(off).mean()) < 1.5 * 0.012 * level


class KnownInPart:
    """Light that is known to be 1 in every other pixel."""

    def at(self, pixel, points, normals, width):
        """See KnownLight.at."""
        return np.ones(points.shape, np.float32), pixel % 2 == 0


def test_samples_that_refine_a_picture_gather_what_is_unknown_whatever_the_budget(context):
    """Of large pictures not all pixels have rays in each sample; those that refine them have."""
    pixel, effect = np.arange(SIZE[0] * SIZE[1]), get("ray_traced")
    samples = Samples(SIZE, pixel, np.full(pixel.size, 5), np.zeros((pixel.size, 2)), KnownInPart())
    frame = draw_samples(context, None, view(), samples)
    ample, scarce = (effect.apply(frame, None, effect.Settings(16, budget=budget)) for budget in (100.0, 0.001))
    assert np.array_equal(ample, scarce)


def test_first_samples_have_half_the_rays_and_later_whole_ones_twice_as_many(context, monkeypatch):
    """Of effects that gather light by rays, where an error is asked for; samples of single pixels have what is set."""
    effect, rays = get("ray_traced"), []
    apply = type(effect).apply

    def counted(self, frame, field, settings):
        rays.append((frame.samples is not None, settings.diffuse_rays))
        return apply(self, frame, field, settings)

    monkeypatch.setattr(type(effect), "apply", counted)
    # As if its light was never known well enough.
    settle = KeptLight.settle
    monkeypatch.setattr(KeptLight, "settle", lambda *arguments: (settle(*arguments)[0], False))
    by_rays(context, 0.001, 32)
    whole = [count for single, count in rays if not single]
    assert whole[:FIRST] == [2] * FIRST and whole[FIRST:] and set(whole[FIRST:]) == {8}
    assert {count for single, count in rays if single} == {4}
    rays.clear()
    by_rays(context, None, 2)
    assert rays == [(False, 4)] * 2
    plain = effect.Settings(diffuse_rays=0)
    assert effect.gathering(plain, 2.0) == plain and effect.gathering(effect.Settings(1), 0.5).diffuse_rays == 1
    assert effect.gathering(effect.Settings(1000), 2.0).diffuse_rays == 1024


def test_pictures_by_need_are_the_same_for_any_number_of_threads():
    one, many = (by_rays(stage(), 0.015, 32, threads=threads) for threads in (1, 3))
    assert one.samples == many.samples > FIRST and np.array_equal(one.pictures["combined"], many.pictures["combined"])


def test_effects_that_look_at_neighbours_have_samples_everywhere(context):
    drawn = by_rays(context, 0.012, 12, ("ray_traced", "stylized"))
    assert drawn.samples == int(drawn.samples) and (drawn.error <= 0.012 or drawn.samples == 12)


@pytest.mark.parametrize("orthographic", [False, True])
def test_samples_of_single_pixels_are_those_of_whole_pictures(context, orthographic):
    """Of every pixel, as many at once as there are: light of neighbours is shared among those of one number."""
    seen_by, effects = view(orthographic=orthographic), [Chosen(get(name), get(name).Settings()) for name in ("ray_traced", "mist")]
    offsets = {index: sample_offset(index) for index in (0, 3, 130)}
    whole = [apply_all(draw_frame(context, None, seen_by, SIZE, index=index, offset=offset), None, effects)
             for index, offset in offsets.items()]
    count = SIZE[0] * SIZE[1]
    samples = Samples(SIZE, np.tile(np.arange(count), 3), *(np.repeat(part, count, 0) for part in (
        list(offsets), list(offsets.values()))))
    part = apply_all(draw_samples(context, None, seen_by, samples), None, effects)
    for place, frame in enumerate(whole):
        own = slice(place * count, (place + 1) * count)
        assert np.array_equal(part.gbuffer.primitive[0, own], frame.gbuffer.primitive.reshape(-1))
        assert np.allclose(part.light[0, own], frame.light.reshape(-1, 4), rtol=1e-4, atol=1e-5)


def test_few_pixels_have_their_samples_in_few_batches(context, monkeypatch):
    """Passes of few pixels cost what their rays cost, not a picture each."""
    drawn, draw = [], picture.draw_samples

    def counted(context, field, view, samples, **options):
        drawn.append(len(samples.pixel))
        return draw(context, field, view, samples, **options)

    monkeypatch.setattr(picture, "draw_samples", counted)
    fine = by_rays(context, 0.01, 256)
    looks = 1 + np.log(fine.samples / FIRST) / np.log1p(_ONE_LOOK)
    assert sum(drawn) == round((fine.samples - FIRST) * SIZE[0] * SIZE[1]) and len(drawn) <= looks + sum(drawn) / picture._AT_ONCE


def test_edges_are_no_noise_for_ever():
    """Of a pixel that an edge halves, every other sample lies on one side: that they differ says nothing about the mean."""
    film = Film((1, 1), ())
    for index in range(64):
        if index in (4, 8, 16, 32):
            film.look()
        film.add(SimpleNamespace(light=np.full((1, 1, 4), float(sample_offset(index)[0] > 0.1)), samples=None))
    assert film.error() < 0.02
