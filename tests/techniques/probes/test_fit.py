"""Probes fitted to how they are read: nearer to the path reference on surfaces and in the air, never where no light is; and what a
bake promises, kept."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from probe_bakes import Memory, bake, bytes_of, coefficients

from rtgi_addon.evaluate.metrics import relative_rmse
from rtgi_addon.evaluate.receivers import surface_receivers
from rtgi_addon.scene import ProbeVolume
from rtgi_addon.techniques.lattice import fitting
from rtgi_addon.techniques.probes import fit as fit_module
from rtgi_addon.techniques.probes import fit_points
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at

COARSE = {"error": 0.1}


def lit_room():
    """A box of side 2 with a lamp off its middle and a coarse lattice."""
    return replace(build.closed_box(0.7, light_position=(0.3, -0.2, 0.5)),
                   volumes=(build.volume(resolution=(3, 3, 3), half_size=1.0),))


@pytest.fixture(autouse=True)
def few_points(monkeypatch):
    """As many as a room of 27 probes needs, no more."""
    monkeypatch.setattr(fit_points, "FEWEST_POINTS", 1024)


def errors(scene, *fields, points=100, seed=5):
    """Relative RMSE (fields, 2) on surfaces under their own normals, and a little above them under tilted ones."""
    context = LightContext(scene)
    eyes = np.concatenate([grid.volume.world_from_local[:3, 3][None] for grid in fields[0].grids()])
    asked = surface_receivers(context, eyes, points, seed=seed, lift=0.1)
    truth = irradiance_at(context, asked.points, asked.normals, 256, seed=3)
    return np.array([[relative_rmse(field.irradiance(*asked[:2])[rows], truth.mean[rows], truth.standard_error[rows] ** 2)
                      for rows in (asked.own, ~asked.own)] for field in fields])


def test_light_on_surfaces_and_above_them_gets_better():
    scene = lit_room()
    measured, fitted = bake(scene, **COARSE), bake(scene, fit=True, **COARSE)
    before, after = errors(scene, measured, fitted)
    assert after[0] < 0.75 * before[0] and after[1] < 0.9 * before[1], (before, after)
    assert all(grid.fitted for grid in fitted.grids()) and not any(grid.fitted for grid in measured.grids())
    [told] = fitted.stats["fits"]
    assert told["price"] > 0 and told["on_surfaces"][1] < told["on_surfaces"][0] and "fits" not in measured.stats


def test_light_in_the_air_gets_no_worse_where_the_fit_did_not_look():
    scene = lit_room()
    rng = np.random.default_rng(4)
    points, normals = rng.uniform(-0.9, 0.9, (300, 3)), rng.normal(size=(300, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    truth = irradiance_at(LightContext(scene), points, normals, 512, seed=6)
    before, after = (relative_rmse(bake(scene, fit=fit, **COARSE).irradiance(points, normals), truth.mean, truth.standard_error**2)
                     for fit in (False, True))
    assert after < before


def test_dark_rooms_stay_dark():
    """Probes that hold nothing hold nothing, to the bit, and what is read beside them is no brighter."""
    scene = rooms.two_rooms()
    measured, fitted = bake(scene, **COARSE), bake(scene, fit=True, **COARSE)
    black = ~coefficients(measured).any(axis=(1, 2))
    assert black.any() and not black.all() and not coefficients(fitted)[black].any()
    asked = surface_receivers(LightContext(scene), np.array([[0.5, 0.0, 0.0]]), 300, seed=2, lift=0.05)
    before, after = (field.irradiance(*asked[:2]).mean() for field in (measured, fitted))
    assert after <= 1.05 * before


def test_no_probe_is_made_to_see_past_what_stands_in_its_way(monkeypatch):
    """Distances grow by little; and where light would leak to held points in the dark, the measurement stays."""
    scene = rooms.two_rooms()
    measured, fitted = bake(scene, **COARSE), bake(scene, fit=True, **COARSE)
    for before, after in zip(measured.grids(), fitted.grids(), strict=True):
        most = 1.001 * np.exp(fitting.MOST_GROWN) * before.visibility[..., 0]
        assert after.fitted and np.all(after.visibility[..., 0] <= most)
    monkeypatch.setattr(fitting, "MOST_LEAKED", -1.0)
    assert bake(scene, fit=True, **COARSE).stats["fits"][0]["price"] is None


def test_points_are_drawn_where_it_is_dark_beside_light():
    """As many in the black room of two as the limits ask for, though area gives it points as well; none where all is lit."""
    lit, dark = (FitPointsOf(scene) for scene in (lit_room(), rooms.two_rooms()))
    assert lit.dark == 0 and dark.dark >= 256
    assert dark.light_there < fitting.DARK * dark.mean_light


@pytest.mark.parametrize("settings", [{"order": 1}, {"direct": True}, {"order": 3}, {"bounces": 1}], ids=str)
def test_every_setting_can_be_fitted(settings):
    field = bake(lit_room(), fit=True, **COARSE, **settings)
    assert np.isfinite(coefficients(field)).all() and len(field.stats["fits"]) == 1


def test_limited_bounces_are_fitted_to_as_many():
    """Not to what the cache holds for probes' rays, which is one fewer: of one bounce, nothing."""
    scene = lit_room()
    context = LightContext(scene)
    asked = surface_receivers(context, np.zeros((1, 3)), 100, 1, seed=5)
    truth = irradiance_at(context, asked.points, asked.normals, 256, bounces=1, seed=3)
    before, after = (relative_rmse(bake(scene, fit=fit, bounces=1, **COARSE).irradiance(*asked[:2]), truth.mean,
                                   truth.standard_error**2) for fit in (False, True))
    assert after < 0.8 * before, (before, after)


def test_without_bounces_there_is_nothing_to_fit_to():
    field = bake(lit_room(), fit=True, bounces=0, **COARSE)
    assert "fits" not in field.stats and not field.grids()[0].fitted


def test_what_is_not_fitted_is_what_it_was():
    assert bytes_of(bake(lit_room(), **COARSE)) == bytes_of(bake(lit_room(), fit=False, **COARSE))


def test_threads_and_resuming_change_nothing():
    scene = lit_room()
    expected = bytes_of(bake(scene, fit=True, threads=1, **COARSE))
    assert bytes_of(bake(scene, fit=True, threads=3, **COARSE)) == expected
    broken = Memory(stop=1)
    with pytest.raises(KeyboardInterrupt):
        bake(scene, fit=True, checkpoint=broken, **COARSE)
    assert bytes_of(bake(scene, fit=True, checkpoint=Memory(broken.stored), **COARSE)) == expected


def test_nested_volumes_are_fitted_together_as_they_are_read():
    scene = lit_room()
    inner = ProbeVolume("inner", np.diag([0.4, 0.4, 0.4, 1.0]), (3, 3, 3))
    scene = replace(scene, volumes=(*scene.volumes, inner))
    measured, fitted = bake(scene, **COARSE), bake(scene, fit=True, **COARSE)
    before, after = errors(scene, measured, fitted)
    assert np.all(after < before) and [grid.fitted for grid in fitted.grids()] == [True, True]


def test_only_the_volumes_that_ask_for_it_are_fitted():
    scene = lit_room()
    inner = ProbeVolume("inner", np.diag([0.4, 0.4, 0.4, 1.0]), (3, 3, 3))
    asking = replace(scene.volumes[0], settings={"fit": True})
    field = bake(replace(scene, volumes=(asking, inner)), **COARSE)
    assert [grid.fitted for grid in field.grids()] == [True, False]


def test_relit_probes_are_fitted_to_the_other_light():
    scene = lit_room()
    other = replace(scene, lights=(build.point_light((-0.4, 0.5, 0.6), (0.3, 1.5, 2.0)),))
    relit, plain = bake(scene, fit=True, **COARSE).relight(other), bake(other, **COARSE)
    before, after = errors(other, plain, relit)
    # Its distances are those that were best under the first light.
    assert after[0] < 0.75 * before[0] and after[1] < 1.15 * before[1], (before, after)


def test_a_fit_that_brings_nothing_is_not_taken(monkeypatch):
    monkeypatch.setattr(fit_module.Fit, "__init__", _refusing(fit_module.Fit.__init__))
    field = bake(lit_room(), fit=True, **COARSE)
    assert field.stats["fits"][0]["price"] is None and not field.grids()[0].fitted
    assert bytes_of(field) == bytes_of(bake(lit_room(), **COARSE))


class FitPointsOf:
    """What the points above surfaces of a fit of ``scene`` are: how many of them were drawn where it is ``dark``, their mean
    luminance ``light_there`` and that of all others."""

    def __init__(self, scene):
        taken = []
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(fit_module, "Fit", _keeping(fit_module.Fit, taken))
            bake(scene, fit=True, **COARSE)
        [(_, above, _)] = taken
        rare = above.weight < 0.5 * above.weight.max()
        light = above.irradiance.mean(axis=1)
        self.dark = int(rare.sum())
        self.light_there, self.mean_light = (float(light[rows].mean()) if rows.any() else 0.0 for rows in (rare, ~rare))


def _keeping(real, taken):
    def made(field, kinds, *rest):
        taken.append(kinds)
        return real(field, kinds, *rest)

    return made


def _refusing(real):
    def init(self, *arguments):
        real(self, *arguments)
        self.price = None

    return init
