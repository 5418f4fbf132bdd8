"""Whose bundle it is: renamed, moved and changed it stays its scene's; another scene's is refused by name."""

from dataclasses import replace

import pytest
import scene_builders as build

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.schema import read_manifest
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.belonging import require_of_scene


@pytest.fixture(scope="module")
def baked(tmp_path_factory):
    """A scene of a file, and its bundle."""
    scene = replace(build.closed_box(), source="/somewhere/hall.blend")
    out = tmp_path_factory.mktemp("belonging") / "bake"
    bake_scene(scene, overrides={"rays": 64, "bounces": 1}, out=out, state="abc")
    return scene, out


def test_the_bundle_remembers_its_file_and_state(baked):
    stats = read_manifest(baked[1])["stats"]
    assert stats["file"] == "hall.blend" and stats["state"] == "abc" and stats["usable"] == 8


def test_what_was_renamed_or_moved_is_still_of_its_scene(baked):
    scene, out = baked
    moved = (replace(scene.volumes[0], world_from_local=build.transform((0.1, 0, 0), (0.4, 0.4, 0.4))),)
    for same in (scene, replace(scene, source="/elsewhere/hall.blend", volumes=moved), replace(scene, source="/x/copy.blend"),
                 replace(scene, source="", volumes=moved), replace(scene, lights=())):
        require_of_scene(out, same)


@pytest.mark.parametrize(("change", "said"), [({"name": "cellar"}, "of scene 'closed_box'"),
                                              ({"source": "/x/cellar.blend", "volumes": (build.volume(center=(5, 0, 0)),)},
                                               "of another file, hall.blend")])
def test_another_scenes_bundle_is_refused(baked, change, said):
    with pytest.raises(BakeError, match=said) as refused:
        require_of_scene(baked[1], replace(baked[0], **change))
    assert "give its bundle" in refused.value.remedy
