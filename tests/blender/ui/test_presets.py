"""Draft, Preview and Final, and the user's own: shown from the add-on's folder, applied as one step of undo, saved and removed."""

import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import rtgi_addon  # noqa: E402
from rtgi_addon import techniques  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
SHIPPED = ["Draft.py", "Final.py", "Preview.py"]


@pytest.fixture
def settings(empty_blend):
    """``Scene.rtgi`` of a fresh file."""
    from rtgi_addon.blender.ui.presets import RTGI_PT_presets
    rtgi_addon.register()
    label = RTGI_PT_presets.bl_label
    yield bpy.context.scene.rtgi
    # Blender writes the name of the preset that was applied last there.
    RTGI_PT_presets.bl_label = label
    rtgi_addon.unregister()


def shown():
    """The files that the popover lists."""
    return sorted(path.name for folder in bpy.utils.preset_paths("rtgi") for path in Path(folder).glob("*.py"))


def apply(name):
    return bpy.ops.rtgi.apply_preset(filepath=bpy.utils.preset_find(name, "rtgi"))


def test_the_presets_of_the_add_on_are_listed_without_being_copied(settings):
    assert shown() == SHIPPED
    rtgi_addon.unregister()
    assert shown() == []
    rtgi_addon.register()
    assert shown() == SHIPPED


def test_a_preset_sets_every_technique_and_leaves_the_rest(settings):
    settings.technique, settings.seed, settings.mode = "vpl", 5, "RAYS"
    settings.technique_probes.order = 1
    assert apply("Draft") == {"FINISHED"}
    assert settings.technique_probes.error == pytest.approx(0.1) and settings.mode == "ERROR"
    assert settings.technique_vpl.lights == techniques.get("vpl").presets["draft"]["lights"]
    assert (settings.technique, settings.seed, settings.technique_probes.order) == ("vpl", 5, 1)
    apply("Final")
    assert settings.technique_probes.error == pytest.approx(0.01) and settings.technique_rsm.visibility


@pytest.mark.parametrize("name", techniques.names())
def test_presets_of_a_technique_are_settings_of_it_and_say_the_same_things(name):
    technique = techniques.get(name)
    assert list(technique.presets) == list(techniques.PRESETS)
    assert len({tuple(values) for values in technique.presets.values()}) == 1
    known = {item.name for item in fields(technique.Settings)}
    for values in technique.presets.values():
        assert set(values) <= known
        techniques.validate_settings(technique.Settings(**values))


def test_the_tooltip_says_what_a_preset_costs(settings):
    from types import SimpleNamespace

    from rtgi_addon.blender.ui.presets import TOOLTIPS, RTGI_OT_apply_preset
    assert set(TOOLTIPS) == set(techniques.PRESETS)
    for name in SHIPPED:
        properties = SimpleNamespace(filepath=bpy.utils.preset_find(name[:-3], "rtgi"))
        assert re.search(r"\d s\b", RTGI_OT_apply_preset.description(bpy.context, properties))
    assert RTGI_OT_apply_preset.description(bpy.context, SimpleNamespace(filepath="/mine.py")) == RTGI_OT_apply_preset.__doc__


def test_the_presets_of_the_add_on_cannot_be_removed(settings):
    with pytest.raises(RuntimeError, match="belongs to the add-on"):
        bpy.ops.rtgi.add_preset(name="Draft", remove_name=True)
    assert shown() == SHIPPED


def test_a_broken_preset_is_reported(settings, tmp_path):
    (tmp_path / "broken.py").write_text("raise ValueError('no')\n")
    with pytest.raises(RuntimeError, match="no"):
        bpy.ops.rtgi.apply_preset(filepath=str(tmp_path / "broken.py"))


USERS = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import bpy, rtgi_addon
rtgi_addon.register()
rtgi = bpy.context.scene.rtgi
rtgi.technique, rtgi.mode = "probes", "RAYS"
rtgi.technique_probes.rays, rtgi.technique_probes.use_bounces, rtgi.technique_probes.bounces = 99, True, 3
assert bpy.ops.rtgi.add_preset(name="My night") == {"FINISHED"}
saved = Path(bpy.utils.preset_find("My_night", "rtgi"))
print("SAVED", saved.relative_to(sys.argv[2]))
rtgi.use_preset("final")
rtgi.technique, rtgi.technique_probes.use_bounces = "lpv", False
bpy.ops.rtgi.apply_preset(filepath=str(saved))
probes = rtgi.technique_probes
print("BACK", rtgi.technique, rtgi.mode, probes.rays, probes.use_bounces, probes.bounces)
bpy.ops.rtgi.add_preset(name="Draft")
print("DRAFT", Path(bpy.utils.preset_find("Draft", "rtgi")).parent.parent.parent.name)
bpy.ops.rtgi.add_preset(name="My_night", remove_name=True)
print("LEFT", saved.exists())
"""


def test_users_save_and_remove_their_own(tmp_path):
    """In a process with a user folder of its own."""
    import os
    ran = subprocess.run([sys.executable, "-c", USERS, str(ROOT), str(tmp_path)], capture_output=True, text=True, check=False,
                         env={**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path)})
    lines = [line for line in ran.stdout.splitlines() if line.split(" ")[0] in {"SAVED", "BACK", "DRAFT", "LEFT"}]
    expected = ["SAVED scripts/presets/rtgi/My_night.py", "BACK probes RAYS 99 True 3", "DRAFT blender", "LEFT False"]
    assert lines == expected, ran.stderr


@pytest.mark.parametrize(("words", "settings"), [
    (["--preset", "draft"], {"error": 0.1, "max_rays": 4096}),
    (["--preset", "draft", "--error", "0.2", "--order", "1"], {"error": 0.2, "max_rays": 4096, "order": 1}),
    (["--preset", "final", "--technique", "vpl", "--set", "lights=64"], {"lights": "64"}),
    (["--preset", "draft", "--technique", "nobody"], {}),
    ([], {}),
])
def test_in_a_shell_other_options_go_before_the_preset(words, settings):
    from rtgi_addon.blender.cli.options import overrides
    from rtgi_addon.blender.cli.parser import build_parser
    assert overrides(build_parser("rtgi").parse_args(["bake", "--out", "x", *words])) == settings
