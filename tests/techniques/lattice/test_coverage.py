"""Where volumes lie: what a bake refuses, replaces or warns of, and what a check says of it before."""

import re
from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.evaluate.plan import Target
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.chart import chart_scene
from rtgi_addon.jobs.check import check
from rtgi_addon.jobs.plan import plan_scene
from rtgi_addon.jobs.stability import run_stability
from rtgi_addon.techniques.lattice.coverage import NoUsableProbe, coverage_findings, surface_points

FAST = {"rays": 64, "bounces": 1}


def lone_cube(*volumes):
    return build.scene([build.cube()], lights=(build.point_light((0, 0, 3)),), volumes=volumes)


def test_a_volume_as_blender_adds_it_to_its_startup_scene_is_fitted_and_told(tmp_path):
    """Its box is that of the startup cube: not one probe is in the open."""
    scene = lone_cube(build.volume("Volume", (4, 4, 4), half_size=1.0))
    found, = check(scene).findings
    summary = bake_scene(scene, overrides=FAST, out=tmp_path / "bake")
    baked, = summary.volumes
    assert baked.fitted and baked.name == "Volume" and baked.usable > 0.5 * baked.probes
    assert found.severity == "warning" and found.subject[0] == ("Volume",)
    assert str(found) in summary.warnings and "every probe of the volume 'Volume' lies inside geometry" in str(found)
    assert f"= {baked.probes} probes was baked in its place" in str(found)
    assert summary.findings[0].subject[0] == ("Volume",) and "findings" not in summary.to_json()


def test_of_several_volumes_the_one_inside_is_refused_by_check_and_bake_alike(tmp_path):
    scene = lone_cube(build.volume("good", half_size=2.0), build.volume("buried", half_size=0.5))
    report = check(scene)
    with pytest.raises(NoUsableProbe, match="buried") as refused:
        bake_scene(scene, overrides=FAST, out=tmp_path / "bake")
    assert str(report.refusal) == str(refused.value) and not (tmp_path / "bake").exists()
    with pytest.raises(NoUsableProbe, match="buried"):
        bake_scene(scene, "vpl", {"lights": 16}, out=tmp_path / "bake")


def test_a_volume_mostly_inside_something_is_warned_of(tmp_path):
    scene = lone_cube(build.volume("wide", (2, 2, 8), half_size=0.9, center=(0, 0, 0.5)))
    found, = [found for found in check(scene).findings if "inside geometry" in str(found)]
    share = int(str(found).split(" % ")[0].split()[-1])
    assert found.severity == "warning" and found.subject[0][0] == "wide" and 50 < share < 100
    assert any("inside geometry" in warning for warning in bake_scene(scene, overrides=FAST, out=tmp_path / "b").warnings)


@pytest.mark.parametrize(("half_size", "center", "outside"), [(1.1, (0, 0, 0), None), (1.1, (1.6, 0, 0), "5[0-9]|6[0-9]"),
                                                              (0.2, (1.0, 1.0, 1.0), "9[0-9]")])
def test_half_the_scene_outside_is_warned_of(half_size, center, outside):
    scene = lone_cube(build.volume("v", (8, 8, 8), half_size=half_size, center=center))
    found = coverage_findings(scene, scene.volumes)
    assert len(found) == (outside is not None)
    if found:
        assert found[0].severity == "warning" and found[0].subject[0] == ("v",)
        assert re.fullmatch(outside, str(found[0]).split("has ")[1].split()[0])


def test_ground_and_fitted_volumes_are_not_warned_of():
    ground = build.plane(half_size=500.0, z=-1.0)
    scene = build.scene([build.cube(), ground], lights=(build.point_light((0, 0, 3)),),
                        volumes=(build.volume("v", (6, 6, 6), half_size=2.2),))
    assert not coverage_findings(scene, scene.volumes)
    far = (replace(build.volume("v", center=(90, 0, 0)), fitted=True),)
    assert not coverage_findings(scene, far) and coverage_findings(scene, (replace(far[0], fitted=False),))


def test_points_lie_on_surfaces_evenly_by_area():
    scene = build.scene([build.plane(half_size=1.0), build.plane(half_size=3.0, z=1.0)])
    points = surface_points(scene, 5000)
    upper = np.abs(points[:, 2] - 1.0) < 1e-9
    assert len(points) == 5000 and np.all(upper | (points[:, 2] == 0.0))
    assert abs(upper.mean() - 0.9) < 5 * np.sqrt(0.09 / 5000)


def test_what_measures_volumes_names_one_without_a_usable_probe(tmp_path):
    """A bake fits one in its place; a chart or a plan of that would be of another volume than the file's."""
    scene = lone_cube(build.volume("Volume", (4, 4, 4), half_size=1.0))
    for measure in (lambda: plan_scene(scene, Target(0.2)), lambda: chart_scene(scene, tmp_path / "chart", ["probes"]),
                    lambda: run_stability(None, scene, techniques=["probes"])):
        with pytest.raises(NoUsableProbe, match="Volume"):
            measure()
