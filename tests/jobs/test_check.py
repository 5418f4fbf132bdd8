"""The pre-flight alone: what it finds, what it says is not followed, and whether a bake would begin."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.jobs.check import check
from rtgi_addon.scene import Omission

HAIR = Omission("fur is hair: it is left out", ("fur",), boxes_world=np.array([[[-0.9, -0.9, -0.9], [0.9, 0.9, -0.8]]]))


def test_a_sound_scene_has_nothing_to_report():
    report = check(build.closed_box())
    assert report.refusal is None and report.to_text() == "closed_box can be baked: nothing to report"
    assert report.to_json() == {"scene": "closed_box", "passes": True, "findings": [], "not_followed": [], "notes": []}


def test_what_is_not_followed_is_told_with_how_much_it_concerns():
    report = check(replace(build.closed_box(), omissions=(HAIR,), notes=("read with care",)))
    concern, = report.not_followed
    assert concern.omission is HAIR and 0.05 < concern.share < 0.4 and report.refusal is None
    assert "omitted  fur is hair: it is left out (concerns" in report.to_text() and "note     read with care" in report.to_text()


def test_what_is_missing_refuses_and_is_told_once():
    gone = Omission("library level.blend is missing, and tower is not there", ("tower",), remedy="restore it")
    report = check(replace(build.closed_box(), omissions=(HAIR, gone)))
    assert report.refusal.cause == gone.text and report.refusal.remedy == "restore it"
    assert report.to_text().count("level.blend") == 1 and "cannot be baked" in report.to_text()
    values = json.loads(json.dumps(report.to_json()))
    assert not values["passes"] and values["findings"][0]["objects"] == ["tower"]
    assert [concern.share for concern in report.not_followed] == [None]


@pytest.mark.parametrize(("name", "objects", "materials"), [("wall", (), ("wall",)), ("light lamp", ("lamp", "light lamp"), ())])
def test_findings_tell_programs_what_they_are_about(name, objects, materials):
    scene = build.closed_box()
    if materials:
        scene = replace(scene, materials=(build.material("wall", 1.0),))
    else:
        scene = replace(scene, lights=(*scene.lights, build.point_light(intensity=-1.0)))
    finding, = check(scene).to_json()["findings"]
    assert (finding["objects"], finding["materials"]) == (list(objects), list(materials)), name
