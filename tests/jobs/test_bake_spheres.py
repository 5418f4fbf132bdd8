"""Sphere probes through a whole bake: the bundle, what is told, what `info` says, and options from a shell."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scene_builders import closed_box, transform

from rtgi_addon.blender.cli.info import BundleReport
from rtgi_addon.blender.cli.options import overrides, sphere_settings
from rtgi_addon.effects.spheres.settings import SphereSettings
from rtgi_addon.errors import UsageError
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.field import bake_field
from rtgi_addon.jobs.relight import LightChange, relight_bundle
from rtgi_addon.scene.sphere_probe import SphereProbe

SMALL = SphereSettings(resolution="32", rays=1)
FEW = {"rays": 16}


def room():
    probes = [SphereProbe(name, transform((x, 0, 0)), clip_start=start) for name, x, start in
              (("ball", 0.2, 0.01), ("outside", 9.0, 0.01), ("blind", 0.0, 1.05))]
    return replace(closed_box(resolution=(2, 2, 2)), spheres=tuple(probes))


def test_a_bake_takes_them_along(tmp_path):
    summary = bake_scene(room(), "probes", FEW, tmp_path / "out", spheres=SMALL, threads=1)
    bundle = read_bundle(tmp_path / "out")
    assert sorted(item.probe.name for item in bundle.spheres.maps) == ["ball", "blind", "outside"]
    told, = (text for text in summary.warnings if "blind" in text)
    assert "does not see room" in told and told in bundle.manifest["notes"]
    ball = next(item for item in bundle.spheres.maps if item.probe.name == "ball")
    assert 0.01 < ball.levels[0].astype(float).mean() < 1.0 and bundle.manifest["stats"]["sphere_rays"] >= 3 * 32 * 32
    # Shadow rays, mirrored ones and those of the light cache are not in that; a plan is held to what is traced without them.
    assert summary.stats["spheres_traced"] > bundle.manifest["stats"]["sphere_rays"]
    text = BundleReport(bundle).to_text()
    assert "sphere     ball: 32 × 32 texels, influence sphere of 2.5 m, parallax sphere, mean radiance" in text
    listed = [found["name"] for found in BundleReport(bundle).to_json()["spheres"]]
    assert listed == [item.probe.name for item in bundle.spheres.maps]


def test_the_same_seed_gives_the_same_maps(tmp_path):
    scene = replace(room(), spheres=room().spheres[:1])
    for name in ("one", "other"):
        bake_scene(scene, "probes", FEW, tmp_path / name, spheres=SMALL, seed=4)
    one, other = ((tmp_path / name / "spheres/ball.exr").read_bytes() for name in ("one", "other"))
    assert one == other


def test_they_can_be_left_out(tmp_path):
    bake_scene(room(), "probes", FEW, tmp_path / "out", spheres=replace(SMALL, bake=False))
    assert read_bundle(tmp_path / "out").spheres is None
    assert bake_field(room(), "probes", FEW).spheres is None
    assert len(bake_field(room(), "probes", FEW, spheres=SMALL).spheres.maps) == 3


def test_relighting_leaves_them_out_and_says_so(tmp_path):
    scene = replace(room(), spheres=room().spheres[:1])
    bake_scene(scene, "transfer", {"rays": 64, "sun_side": 4, "sites": 1}, tmp_path / "out", spheres=SMALL)
    report = relight_bundle(tmp_path / "out", tmp_path / "relit", LightChange(world=(1.0, 1.0, 1.0)))
    assert read_bundle(tmp_path / "relit").spheres is None
    assert report.notes == ("sphere probes are left out: they hold the light of the bake alone",)


def test_charts_of_reflections_show_what_they_saw(monkeypatch):
    from rtgi_addon.jobs import chart_pictures
    asked = []
    monkeypatch.setattr(chart_pictures, "bake_field", lambda *_, **options: asked.append(options["spheres"]))
    for name in ("screen_reflections", "mist"):
        chart_pictures.PictureSurvey(room(), [name], None, 1.0, 1, None)._lit_by(None)
    assert asked == [SphereSettings(), None]


def test_a_plan_says_that_they_are_no_part_of_it():
    from rtgi_addon.jobs.plan_beside import beside
    text, *others = beside(room(), 64)
    assert "(ball, outside, blind)" in text and "0.79 million paths" in text
    assert list(beside(replace(room(), spheres=()), 64)) == others


def test_options_from_a_shell():
    given = SimpleNamespace(assignments=[("spheres.rays", "3"), ("spheres.bake", "no"), ("visibility", "x")], technique="probes",
                            preset=None, order=None, rays=None, error=None, bounces=None, direct=None, fit=None)
    assert sphere_settings(given) == SphereSettings(bake=False, rays=3)
    assert overrides(given) == {"visibility": "x"}
    for name, value in (("spheres.rays", "0"), ("spheres.resolution", "100"), ("spheres.colour", "red")):
        with pytest.raises(UsageError):
            sphere_settings(SimpleNamespace(assignments=[(name, value)]))


def test_no_number_is_lost_in_an_empty_world():
    """A probe that sees nothing at all is black, and no more."""
    scene = replace(room(), spheres=(SphereProbe("far", transform((50, 0, 0))),))
    probes = bake_field(scene, "probes", FEW, spheres=SMALL).spheres
    assert np.isfinite(probes.stacks[0]).all() and probes.stacks[0].max() < 1.0
