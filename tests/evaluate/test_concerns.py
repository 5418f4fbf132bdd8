"""How much light an omission concerns, in scenes where that is known."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from tiny_technique import TinyField, tiny_grid

from rtgi_addon.evaluate.concerns import Concern, concerns, usable_probes
from rtgi_addon.scene import Omission, Omissions
from rtgi_addon.transport.context import LightContext


def share(scene, **named):
    """The share of the light at one probe in the middle that an omission about ``named`` concerns."""
    concern, = concerns(LightContext(scene), np.zeros((1, 3)), (Omission("it is left out", **named),))
    return concern.share


@pytest.fixture(scope="module")
def halves():
    """Two glowing half cubes around the probe: the upper three times as bright as the lower."""
    whole = build.cube("lower", inward=True)
    above = whole.vertices_local[whole.triangles].mean(axis=1)[:, 2] > 0.5
    lower = replace(whole, triangles=whole.triangles[~above], triangle_material=np.zeros(int((~above).sum()), np.int32))
    upper = replace(whole, name="upper", triangles=whole.triangles[above], triangle_material=np.ones(int(above.sum()), np.int32))
    return build.scene([lower, upper], [build.material("dim", 0.0, 1.0), build.material("bright", 0.0, 3.0)])


def test_a_surface_concerns_what_comes_from_it(halves):
    # One face of a cube fills a sixth of the sphere around its centre.
    expected = 3 / 6 / (3 / 6 + 5 / 6)
    assert share(halves, objects=("upper",)) == pytest.approx(expected, rel=0.03)
    assert share(halves, materials=("bright",)) == pytest.approx(expected, rel=0.03)
    assert share(halves, objects=("upper",), materials=("dim",)) == pytest.approx(1.0)


def test_what_was_taken_for_black_concerns_as_much_as_if_it_were_as_bright_as_the_rest(halves):
    unread = replace(halves, materials=(halves.materials[0], build.material("bright", 0.0, 0.0)))
    assert share(unread, materials=("bright",)) == pytest.approx(1 / 6, rel=0.03)


def test_what_has_no_surface_concerns_what_passes_through_it(halves):
    behind = np.array([[[-9, -9, 2], [9, 9, 3]]], float)
    around = np.array([[[-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]]])
    below = np.array([[[-0.9, -0.9, -0.9], [0.9, 0.9, -0.5]]])
    assert share(halves, boxes_world=behind) == 0.0
    assert share(halves, boxes_world=around) == pytest.approx(1.0)
    # The box's upper rim is met by all rays below the cone to it; its sides reach to 45° and a little more.
    assert 1 / 6 / (8 / 6) < share(halves, boxes_world=below) < 3 / 6 / (8 / 6)
    assert share(halves, boxes_world=np.concatenate([behind, around])) == pytest.approx(1.0)


def test_a_lamp_concerns_what_it_gives():
    lamps = [build.point_light((0.5, 0, 0), 1.0, "weak"), build.point_light((-0.5, 0, 0), 3.0, "strong")]
    scene = build.scene([build.cube("room", inward=True)], lights=lamps)
    assert share(scene, objects=("weak",)) == pytest.approx(0.25, abs=0.03)
    assert share(scene, objects=("weak", "strong")) == pytest.approx(1.0, abs=1e-3)


def test_what_is_not_in_the_scene_is_not_known(halves):
    assert share(halves, objects=("gone",)) is None
    assert "not known" in str(Concern(Omission("it is gone"), None))
    dark = build.scene([build.cube("room", inward=True)])
    assert share(dark, objects=("room",)) is None


def test_what_is_not_known_comes_first_then_the_most(halves):
    found = concerns(LightContext(halves), np.zeros((1, 3)), tuple(Omission(name, (name,)) for name in ("gone", "upper", "lower")))
    assert [concern.omission.text for concern in found] == ["gone", "lower", "upper"]
    assert str(found[1]).startswith("lower (concerns 62 %") and "estimated" in str(found[1])
    assert found[2].to_json() == {"text": "upper", "objects": ["upper"], "materials": [], "share": found[2].share,
                                  "how": "estimated"}


def test_placements_of_one_object_become_one_line():
    collected = Omissions()
    for place in range(3):
        collected.add("fog is left out", objects=["fog"], box_world=[[place] * 3, [place + 1] * 3])
    collected.add("hair is left out", materials=["fur"])
    fog, hair = collected.all()
    assert fog.objects == ("fog",) and fog.boxes_world.shape == (3, 2, 3)
    assert (str(hair), hair.materials, hair.boxes_world) == ("hair is left out", ("fur",), None)


def test_usable_probes_are_those_in_the_open():
    grid = tiny_grid(build.volume("V", (2, 1, 1)), np.zeros((1, 1, 2, 4, 3), np.float32))
    grid.validity[0, 0, 0] = 0.0
    np.testing.assert_allclose(usable_probes(TinyField([grid], False, {})), [[0.25, 0.0, 0.0]])
