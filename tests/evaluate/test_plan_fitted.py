"""Plans that know what a fit brings: fewer probes, an error that was measured, and a bake that is not made twice."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.evaluate.plan import Target, choice, make_plan
from rtgi_addon.evaluate.plan.nesting import Box, nested_volume
from rtgi_addon.evaluate.plan.sample import draw_sample
from rtgi_addon.evaluate.references import PathReference
from rtgi_addon.progress import Progress
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.rays.ray_counter import count_rays


def chambers():
    """Two of them, one with a lamp, and a gap in the wall between."""
    def block(name, low, high, material, inward=False):
        corners = (0.5 * build.CUBE_CORNERS + 0.5) * (np.subtract(high, low)) + low
        return build.mesh(name, corners, build.CUBE_TRIANGLES[:, ::-1] if inward else build.CUBE_TRIANGLES, material)

    meshes = [block("room", (-2, -1, -1), (2, 1, 1), 0, True), block("wall", (-0.1, -0.999, -0.999), (0.1, 0.3, 0.999), 1)]
    materials = [build.material("white", 0.75), build.material("grey", 0.5)]
    return build.scene(meshes, materials, [build.point_light((-1, 0.2, 0.6), 4.0)],
                       volumes=[build.volume(resolution=(7, 4, 4), half_size=(1.9, 0.95, 0.95))])


def test_fitted_probes_are_fewer_and_as_right_as_was_said():
    scene, method = chambers(), techniques.get("probes")
    measured, plan = (make_plan(scene, Target(0.09, fit=fit), others=False, points=1024, threads=1) for fit in (False, True))
    assert plan.settings == {**measured.settings, "fit": True} and plan.met and "fit" not in measured.settings
    assert plan.probes < 0.7 * measured.probes == 0.7 * plan.found.measured.lattice_points
    assert any(line.startswith("Fitted to surfaces, ") and f"takes {measured.probes:,} as" in line for line in plan.reasons)
    assert [option.label for option in plan.options[:2]] == ["planned", "not fitted"]
    begun, planned = plan.found.reading.pilot.begun, plan.applied(scene)

    def bake(settings):
        with count_rays() as counter:
            field = method.bake(planned, settings, np.random.default_rng(0), Progress(), threads=1, begun=begun)
        return field, counter.rays

    settings = method.Settings(**plan.settings)
    field, rays = bake(settings)
    assert rays == 0 and field is plan.found.finished.field and len(field.stats["fits"]) == 1
    assert bake(replace(settings, direct=True))[1] > 0 and not begun.finished.is_of(planned.volumes, settings, 1)
    context = LightContext(scene, 1)
    sample = draw_sample(context, scene.volumes, 300, 99)
    truth = PathReference(context, 0.05).irradiance(sample.receivers)
    found = sample.error(field.irradiance(sample.receivers.points, sample.receivers.normals), truth)
    spread = np.hypot(found.standard_error, plan.chosen.error.standard_error)
    assert found.value == pytest.approx(plan.chosen.error.value, abs=4 * spread) and found.value < 0.09 + 2 * spread


def test_where_a_fit_brings_nothing_the_lattice_stays_and_its_own_error_is_told(monkeypatch):
    """A fit that leaves all as it was: every coarser lattice is as wrong as without."""
    from rtgi_addon.techniques.probes import Probes

    bake = Probes.bake

    def without(self, scene, settings, *arguments, **options):
        return bake(self, scene, replace(settings, fit=False), *arguments, **options)

    monkeypatch.setattr(Probes, "bake", without)
    plan = make_plan(chambers(), Target(0.09, fit=True), others=False, points=512, threads=1)
    assert plan.found.reading is plan.found.measured and plan.settings["fit"]
    assert "no coarser lattice that was tried does" in " ".join(plan.reasons)
    assert plan.chosen.error.value == pytest.approx(plan.found.reading.error(plan.found.order, plan.found.ray_error).value, rel=0.4)


def test_volumes_in_volumes_are_fitted_with_those_that_they_lie_in(monkeypatch):
    """A box of finer cells in half of a coarse lattice, as if one had been found to pay."""
    def nest(pilot, found, *_):
        base = replace(found.reading.volumes[0], resolution=(6, 3, 3))
        boxed = (base, nested_volume(base, Box((0, 0, 0), (3, 3, 3), 0.5), "Volume fine 1"))
        reading = pilot.measure_volumes(boxed, Progress(), 1)
        return replace(found, reading=reading, error=reading.error(found.order, found.ray_error), nesting="nested",
                       single=found.reading)

    monkeypatch.setattr(choice, "nest", nest)
    scene = chambers()
    plan = make_plan(scene, Target(0.12, fit=True), others=False, points=512, threads=1)
    coarse, fine = plan.volumes
    nested = plan.found.measured.lattice_points
    assert plan.settings["fit"] and plan.met and fine.planned == coarse.name and plan.probes < nested
    assert any(line.startswith(f"Nested so, {nested} probes") for line in plan.reasons)
    planned, method = plan.applied(scene), techniques.get("probes")
    field = method.bake(planned, method.Settings(**plan.settings), np.random.default_rng(0), Progress(), threads=1,
                        begun=plan.found.reading.pilot.begun)
    assert field is plan.found.finished.field and len(field.grids()) == 2
