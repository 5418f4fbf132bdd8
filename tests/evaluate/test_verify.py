"""Holding a reading to a judge: here the judge is our own path tracer on a scene that differs in something that is known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scene_builders as build
from room_scenes import moved

from rtgi_addon.evaluate.metrics import Figure
from rtgi_addon.evaluate.references import Truth
from rtgi_addon.evaluate.verify import Difference, Suspect, choose_places, replaced, search, suspects_of
from rtgi_addon.evaluate.verify.places import NORMALS, WEIGHTS, radiance_from_patches
from rtgi_addon.evaluate.verify.suspects import LAMP, MATERIAL, OBJECT, WORLD, plain_world
from rtgi_addon.jobs.verify import verify
from rtgi_addon.numerics import sh
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.progress import Progress
from rtgi_addon.scene import AreaLight, Omission, World
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.lights.kinds import kind_of
from rtgi_addon.transport.paths.reference import irradiance_at, probe_sh


class PathJudge:
    """The path tracer on ``truth``; ``asked`` keeps without whom it was. Lamps are replaced by what was read of them."""

    kind = "the truth"
    sees_media = True

    def __init__(self, truth):
        self.scene, self.asked = truth, []

    def irradiance(self, places, without, progress):
        """See Judge."""
        self.asked.append(without)
        names = {suspect.name for suspect in without if suspect.kind == LAMP}
        read = {light.name: light for light in scene().lights}
        lights = tuple(read[light.name] if light.name in names else light for light in self.scene.lights)
        context = LightContext(replaced(replace(self.scene, lights=lights), without))
        found = irradiance_at(context, places.points, places.normals, 256, seed=5, direct=True)
        return Truth(found.mean.astype(float), found.standard_error.astype(float) ** 2)


def scene():
    """A closed room with a lamp, a box and a shining panel, each of a material of its own."""
    meshes = [build.cube("room", inward=True), moved(build.cube("box", 0.4, material_index=1), (0.3, 0.2, -0.55)),
              moved(build.plane("panel", 0.3, material_index=2), (-0.5, -0.5, 0.9))]
    materials = [build.material("wall", 0.4), build.material("paint", (0.7, 0.1, 0.1)), build.material("glow", 0.2, 3.0)]
    lamps = [build.point_light((0.0, 0.5, 0.5), 1.0, "lamp"), build.point_light((0.5, -0.5, 0.7), 0.5, "candle")]
    return build.scene(meshes, materials, lamps, volumes=[build.volume(resolution=(3, 3, 3), half_size=0.8)], name="room")


def test_one_scene_agrees_with_itself():
    report = verify(scene(), PathJudge(scene()), points=24, probes=2, paths=256)
    assert report.agrees and report.as_read.figure.value < 0.02 and report.refusal is None and not report.culprits
    assert report.verdict.startswith("room agrees with the truth within") and report.to_json()["agrees"]


def other_lamp(scene):
    return replace(scene, lights=(replace(scene.lights[0], intensity=scene.lights[0].intensity * 4), scene.lights[1]))


def other_material(scene):
    return replace(scene, materials=(scene.materials[0], build.material("paint", 0.95, 2.0), scene.materials[2]))


def without_box(scene):
    return replace(scene, instances=(scene.instances[0], scene.instances[2]))


@pytest.mark.parametrize(("change", "culprits"), [
    (other_lamp, {"lamp lamp"}), (other_material, {"object box", "material paint"})])
def test_who_makes_the_difference_is_found(change, culprits):
    report = verify(scene(), PathJudge(change(scene())), points=24, probes=1, paths=128, most_suspects=8)
    assert not report.agrees and report.as_read.figure.value > 0.08
    found = report.culprits[0]
    assert str(found.suspect) in culprits and found.remaining.figure.value < 0.5 * report.as_read.figure.value
    assert str(found.suspect) in report.refusal.remedy and "differs from the truth by" in report.refusal.cause
    assert str(found.suspect) in report.to_text() and report.to_json()["culprits"][0]["name"] == found.suspect.name


def difference(value, light=1.0):
    return Difference(Figure(value, 0.01), 0.005, light)


SUSPECTS = tuple(Suspect(OBJECT, name) for name in "abcd")


def searched(makes, known=0, dark=()):
    """The culprits' names, and the trials, where each suspect of ``makes`` has a part in the difference and ``dark`` ones take the
    light along."""
    asked = []

    def measure(without, _progress):
        names = "".join(suspect.name for suspect in without)
        asked.append(names)
        left = sum(part**2 for name, part in makes.items() if name not in names) ** 0.5
        return difference(0.0, 0.0) if set(names) & set(dark) else difference(left)

    base = difference(sum(part**2 for part in makes.values()) ** 0.5)
    culprits, alone = search(measure, base, SUSPECTS, known, 0.05, Progress())
    assert set(alone) <= set(SUSPECTS)
    return [culprit.suspect.name for culprit in culprits], asked


def test_the_one_who_makes_it_is_found_and_the_first_of_equals():
    assert searched({"c": 0.5}) == (["c"], ["a", "b", "c", "d"])
    assert searched({"b": 0.5}, known=2)[1] == ["a", "b"]
    assert searched({"c": 0.5}, known=2)[0] == ["c"]


def test_two_are_found_one_after_the_other_and_no_more_than_there_are():
    culprits, asked = searched({"b": 0.3, "d": 0.3})
    assert set(culprits) == {"b", "d"} and len(asked) == 4 + 3
    assert searched({"a": 0.3, "b": 0.3, "c": 0.3, "d": 0.3})[0] == []
    assert searched({"outside": 0.5})[0] == []


def test_darkness_is_no_agreement():
    assert searched({"outside": 0.5}, dark="b")[0] == []
    assert searched({"c": 0.5}, dark="c")[0] == []


def test_what_is_known_not_to_be_followed_is_tried_first_and_its_effect_measured():
    judged = PathJudge(scene())
    read = replace(without_box(scene()), omissions=(Omission("box is hair: it is left out", ("box",)),))
    report = verify(read, judged, points=24, probes=1, paths=128)
    assert judged.asked == [(), (Suspect(OBJECT, "box"),)] and str(report.culprits[0].suspect) == "object box"
    concern, = report.not_followed
    assert concern.how == "measured" and concern.share == pytest.approx(report.as_read.figure.value, rel=0.3)
    assert "makes a difference of" in str(concern)


def test_no_suspects_are_tried_if_none_are_wanted():
    judged = PathJudge(other_lamp(scene()))
    report = verify(scene(), judged, points=24, probes=2, paths=64, most_suspects=0)
    assert judged.asked == [()] and not report.agrees and "none of 0 suspects" in report.reason


@pytest.mark.parametrize("direct", [False, True])
def test_a_bake_is_held_to_it_as_well(direct):
    from rtgi_addon.jobs.field import bake_field
    field = bake_field(scene(), "probes", {"direct": direct, "rays": 256})
    right = verify(scene(), PathJudge(scene()), field, points=8, probes=4, paths=256)
    assert right.agrees and right.baked.figure.value < 0.04 and "baked" in right.to_text()
    for grid in field.grids():
        grid.sh[:] *= 1.5
    wrong = verify(scene(), PathJudge(scene()), field, points=8, probes=4, paths=256)
    assert not wrong.agrees and wrong.baked.figure.value == pytest.approx(0.5, rel=0.1)
    assert "the scene was read right" in wrong.reason


def test_probes_that_a_bake_has_moved_are_compared_where_they_stand():
    """The probes of a small volume, told as those of another that all were moved."""
    from rtgi_addon.jobs.field import bake_field
    volume, shift = build.volume(resolution=(2, 2, 2), half_size=0.3), np.float32([0.35, -0.3, 0.3])
    beside = replace(volume, world_from_local=build.transform(shift) @ volume.world_from_local)
    baked = bake_field(replace(scene(), volumes=(beside,)), "probes", {"rays": 256})
    grid = replace(baked.grids()[0], volume=volume, offset_world=np.broadcast_to(shift, (2, 2, 2, 3)))
    field = SimpleNamespace(grids=lambda: (grid,), direct_lamps=baked.direct_lamps)
    read = replace(scene(), volumes=(volume,))
    assert verify(read, PathJudge(read), field, points=8, probes=4, paths=256).agrees
    unmoved = SimpleNamespace(grids=lambda: (replace(grid, offset_world=0 * grid.offset_world),), direct_lamps=baked.direct_lamps)
    assert not verify(read, PathJudge(read), unmoved, points=8, probes=4, paths=256).agrees


def test_patches_give_the_bands_of_the_light_around_them():
    assert WEIGHTS.sum() == pytest.approx(1.0)
    basis = sh.evaluate(NORMALS, 2).astype(float)
    np.testing.assert_allclose(np.einsum("j,jk,jl->kl", 4 * np.pi * WEIGHTS, basis, basis), np.eye(9), atol=1e-5)
    context = LightContext(scene())
    probe = np.zeros((1, 3), np.float32)
    # A patch shows all that comes to its side, lamps among it.
    around = irradiance_at(context, np.tile(probe, (14, 1)), NORMALS.astype(np.float32), 1 << 12).mean[None]
    direct = probe_sh(context, probe, 1, 1 << 14).mean
    np.testing.assert_allclose(radiance_from_patches(around.astype(float)), direct, atol=0.02 * direct[0, 0, 0])


def test_places_lie_in_the_open_and_do_not_see_each_other():
    context = LightContext(scene())
    places = choose_places(context, scene().volumes, 32, 5)
    assert places.surfaces == 32 and len(places.probes) == 5 and places.points.shape == (32 + 70, 3)
    points, normals = places.sites(places.points)[1], places.sites(places.normals)[1]
    assert points.shape == (5, 14, 3)
    # Every corner of every patch lies below the plane of every other.
    for own, facing in zip(points[0], normals[0], strict=True):
        tilt = np.sqrt(1.0 - np.clip(normals[0] @ facing, -1.0, 1.0) ** 2)
        assert ((points[0] - own) @ facing + np.sqrt(0.5) * places.side * tilt).max() < 1e-7


def test_suspects_come_by_what_they_give():
    known, others = suspects_of(LightContext(scene()), np.zeros((1, 3)), (Omission("odd", ("candle",), ("paint",)),))
    assert known == (Suspect(LAMP, "candle"), Suspect(MATERIAL, "paint"))
    assert others[0] == Suspect(LAMP, "lamp") and Suspect(WORLD) not in others
    assert next(suspect.name for suspect in others if suspect.kind == OBJECT) == "room" and len(set(others)) == len(others)


def test_plain_lamps_have_the_power_of_what_they_replace():
    panel = AreaLight("panel", np.zeros(3, np.float32), np.float32([0.5, 0, 0]), np.float32([0, 0.25, 0]), np.float32([0, 0, -1]),
                      np.float32([4, 2, 1]))
    np.testing.assert_allclose(4 * np.pi * kind_of(panel).plain(panel).intensity, np.pi * panel.area * panel.radiance)
    rng = np.random.default_rng(2)
    world = World(rng.random((8, 16, 3)).astype(np.float32))
    directions = fibonacci_sphere(20000)
    row = np.clip((np.arcsin(directions[:, 2]) / np.pi + 0.5) * 8, 0, 7).astype(int)
    column = np.clip((0.5 - np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)) * 16, 0, 15).astype(int)
    np.testing.assert_allclose(plain_world(world).equirect[0, 0], world.equirect[row, column].mean(axis=0), rtol=0.02)
