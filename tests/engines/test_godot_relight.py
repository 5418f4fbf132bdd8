"""Relighting exported to Godot, in a real Godot (see test_godot.py): held to `rtgi relight`, and its sample with a time of day."""

import pytest
from atlas_bundles import relit_atlas_bundle
from real_godot import complaints, damaged, drawing, drawn, finds, godot, headless, imported, needs_godot
from transfer_bundles import transfer_bundle

from rtgi_addon.exchange import engines

SCRIPT = "conformance/relight.gd"
pytestmark = [pytest.mark.slow, needs_godot]


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """The kit with its transfer, exported and imported."""
    return imported(engines.get("godot").export(transfer_bundle(), tmp_path_factory.mktemp("godot") / "kit").out)


def test_scripts_agree_without_a_display(project):
    code, said = godot(project, "--headless", "--script", SCRIPT)
    assert code == 0 and said.count("PASS relit") == 24 and "SKIP the shader" in said and not complaints(said), said


@pytest.mark.parametrize("options", [("--rendering-driver", "vulkan"), ("--rendering-method", "mobile"),
                                     ("--rendering-driver", "opengl3")], ids=["forward+", "mobile", "compatibility"])
def test_shaders_agree(project, options):
    assert drawn(project, SCRIPT, options, 48).count("PASS relit") == 48


def test_lights_that_are_near_some_and_far_from_others_agree(tmp_path):
    """Numbers that are small for their column are as right as any: in a sparse bake of a shop an overcast sky was 1.3 times the
    tolerance off, a light atlas at night 15 times."""
    project = imported(engines.get("godot").export(relit_atlas_bundle(uneven=True), tmp_path / "uneven").out)
    headless(project, SCRIPT, 24)
    headless(project, "conformance/atlas_relight.gd", 24)


def test_the_probes_as_baked_are_read_through_pictures(project):
    """The look-up of an export whose light can change reads the same numbers as any other's."""
    code, said = godot(project, "--rendering-driver", "opengl3", "--script", "conformance/conformance.gd")
    drawing(said)
    assert code == 0 and "FAIL" not in said and "PASS visibility, shader, moved" in said and not complaints(said), said


@pytest.mark.parametrize(("file", "old", "new", "failing"), [
    ("relight.gdshader", "shares = reach * ray", "shares = 0.9 * reach * ray", "as it was baked, shader"),
    ("relight.gdshader", "1.09254843 * n.x * n.z", "-1.09254843 * n.x * n.z", "a sky with bright spots, shader"),
    ("relit.gd", "f.x * (1.0 - f.y)", "f.x * (1.0 - f.x)", "a sun at noon, script"),
    ("relit.gd", "share_two = reach * turn", "share_two = 0.9 * reach * turn", "as it was baked, script"),
], ids=["deringing", "a harmonic", "shares", "deringing in scripts"])
def test_the_kit_finds_damage(project, file, old, new, failing):
    with damaged([project / "rtgi" / file], old, new):
        finds(project, SCRIPT, f"relit kit, {failing}")


def test_the_sample_follows_the_hour(project):
    """Slider, sun, probes on the GPU, and what scripts and dynamic objects read."""
    (project / "day_test.gd").write_text("""extends SceneTree
func _initialize() -> void:
	var scene: Node = (load("res://sample.tscn") as PackedScene).instantiate()
	root.add_child(scene)
	for frame in 10:
		await process_frame
	var relight: Node = scene.get_node("Relight")
	var probes: Node = scene.get_node("Probes")
	var light: Resource = probes.get_node("DynamicObjects").light_data
	var before: Variant = relight._shown
	scene.get_node("Day").hour = 12.0
	for wait in 200:
		await create_timer(0.05).timeout
		if relight._shown != null and relight._shown != before and relight._in_scripts == relight._shown:
			break
	print("entries ", relight._shown.size() / 12, " sun ", relight._suns()[0]["towards"].y > 0.8)
	print("followed ", relight._in_scripts == relight._shown, " light data ", probes.get_node("DynamicObjects").light_data != light)
	quit()
""")
    code, said = godot(project, "--rendering-driver", "opengl3", "--script", "day_test.gd")
    drawing(said)
    # World and group, and four directions about the sun.
    assert code == 0 and "entries 6 sun true" in said and "followed true light data true" in said and not complaints(said), said
