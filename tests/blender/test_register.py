"""Enabling and disabling the add-on: everything comes, everything goes, as often as one likes."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import rtgi_addon  # noqa: E402

REPOSITORY = Path(__file__).resolve().parents[2]


def rtgi_classes():
    """Every registered Blender class of ours."""
    bases = (bpy.types.PropertyGroup, bpy.types.Operator, bpy.types.Panel, bpy.types.RenderEngine)
    return {cls.__name__ for base in bases for cls in base.__subclasses__()
            if cls.__name__.startswith("RTGI_") and getattr(cls, "is_registered", False)}


def rtgi_handlers():
    """Every handler of ours, by event."""
    return {(event, handler.__name__) for event in dir(bpy.app.handlers)
            for handler in (getattr(bpy.app.handlers, event) if isinstance(getattr(bpy.app.handlers, event), list) else ())
            if getattr(handler, "__module__", "").startswith("rtgi_addon")}


def traces():
    """What the add-on leaves in Blender."""
    owners = {owner.__name__ for owner in (bpy.types.Scene, bpy.types.LightProbe, bpy.types.Object, bpy.types.ViewLayer)
              if hasattr(owner, "rtgi") or hasattr(owner, "rtgi_preview")}
    panels = {name for name in dir(bpy.types) if "RTGI" in (getattr(getattr(bpy.types, name), "COMPAT_ENGINES", None) or ())}
    header = {getattr(draw, "__name__", "") for draw in getattr(bpy.types.VIEW3D_MT_editor_menus.draw, "_draw_funcs", ())
              if draw.__module__.startswith("rtgi_addon")}
    return rtgi_classes() | rtgi_handlers() | owners | panels | header | set(dir(bpy.ops.rtgi))


def test_nothing_is_left_after_disabling_twice():
    before = traces()
    registered = []
    for _ in range(2):
        rtgi_addon.register()
        registered.append(traces())
        rtgi_addon.unregister()
        assert traces() == before
    assert registered[0] == registered[1]
    assert {"Scene", "LightProbe", "ViewLayer", "RTGI_OT_bake", "RTGI_PT_bake"} <= registered[0] - before
    assert {"RTGI_RenderEngine", "DATA_PT_EEVEE_light", "RENDER_PT_output", "draw_header"} <= registered[0] - before
    assert {("load_pre", "cancel_before_load"), ("depsgraph_update_post", "compare_after_change")} <= registered[0]


def test_settings_survive_disabling_and_enabling(empty_blend):
    rtgi_addon.register()
    try:
        bpy.context.scene.rtgi.seed = 7
        rtgi_addon.unregister()
        rtgi_addon.register()
        assert bpy.context.scene.rtgi.seed == 7
    finally:
        rtgi_addon.unregister()


def test_settings_are_saved_in_the_file(empty_blend, tmp_path):
    rtgi_addon.register()
    try:
        bpy.context.scene.rtgi.output = "//light/"
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        assert bpy.context.scene.rtgi.output != "//light/"
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
        assert bpy.context.scene.rtgi.output == "//light/"
    finally:
        rtgi_addon.unregister()


def test_a_registration_that_fails_half_way_leaves_nothing(monkeypatch):
    from rtgi_addon.blender.ui import panels

    def refuse():
        raise RuntimeError("no panels today")

    before = traces()
    monkeypatch.setattr(panels, "register", refuse)
    with pytest.raises(RuntimeError, match="no panels"):
        rtgi_addon.register()
    assert traces() == before
    monkeypatch.undo()
    rtgi_addon.register()
    rtgi_addon.unregister()
    assert traces() == before


BLOCKED = """
import sys
blocked = set(sys.argv[2].split(","))
for name in [name for name in sys.modules if name.split(".")[0] in blocked]:
    del sys.modules[name]
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in blocked:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
import importlib.util
find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name.split(".")[0] in blocked else find_spec(name, package)
sys.meta_path.insert(0, Missing())
sys.path.insert(0, sys.argv[1])
import bpy, rtgi_addon
"""


def run_without(packages: str, program: str, *arguments):
    """The finished process of ``program`` in a Blender module that cannot find ``packages`` (separated by commas)."""
    command = [sys.executable, "-c", BLOCKED + program, str(REPOSITORY), packages, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_without_embree_the_panel_still_bakes(tmp_path):
    """Blender's BVH stands in, and the report says what that costs."""
    ran = run_without("embreex,OpenEXR", """
rtgi_addon.register()
bpy.context.scene.rtgi.output = sys.argv[3]
bpy.context.scene.rtgi.mode = "RAYS"
bpy.context.scene.rtgi.technique_probes.rays = 16
bpy.ops.object.lightprobe_add(type="VOLUME", location=(0.0, 0.0, 3.0))
volume = bpy.context.object.data
volume.resolution_x = volume.resolution_y = volume.resolution_z = 2
print("BAKED", bpy.ops.rtgi.bake())
rtgi_addon.unregister()
print("CLEAN", hasattr(bpy.types.Scene, "rtgi"))
""", tmp_path / "bake")
    assert ran.returncode == 0, ran.stderr
    assert "BAKED {'FINISHED'}" in ran.stdout and "CLEAN False" in ran.stdout
    manifest = json.loads((tmp_path / "bake/bake.json").read_text())
    assert any("no Embree" in note and "times slower" in note for note in manifest["notes"])


def test_without_embree_the_shell_still_bakes(tmp_path):
    ran = run_without("embreex,OpenEXR", """
from rtgi_addon.blender.cli import main_module
sys.exit(main_module([sys.argv[4], "bake", "--out", sys.argv[3], "--rays", "16"]))
""", tmp_path / "bake", REPOSITORY / "sample_blends/furnace.blend")
    assert ran.returncode == 0, ran.stderr
    assert "no Embree" in ran.stdout and "5 times slower" in ran.stdout


def test_without_numpy_the_add_on_says_what_to_install():
    ran = run_without("numpy", "rtgi_addon.register()")
    assert "RTGI needs numpy" in ran.stderr.splitlines()[-1] and "restart Blender" in ran.stderr


def test_importing_the_package_imports_neither_blender_nor_dependencies():
    program = ("import sys; sys.path.insert(0, sys.argv[1]); import rtgi_addon; "
               "print(sorted({'bpy', 'numpy', 'OpenEXR', 'embreex'} & set(sys.modules)))")
    ran = subprocess.run([sys.executable, "-c", program, str(REPOSITORY)], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_the_manifest_says_what_the_extension_is():
    tomllib = pytest.importorskip("tomllib")
    manifest = tomllib.loads((REPOSITORY / "blender_manifest.toml").read_text())
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    assert manifest["id"] == "rtgi_addon" and manifest["type"] == "add-on"
    assert manifest["version"] == project["version"]
    assert manifest["blender_version_min"] == "4.5.0"
    assert manifest["license"] == ["SPDX:" + project["license"]["text"]]
    # Blender's own rules: at most 64 characters, no full stop at the end, only the permissions that are used.
    texts = [manifest["tagline"], *manifest["permissions"].values()]
    assert all(len(text) <= 64 and text[-1].isalnum() for text in texts)
    assert set(manifest["permissions"]) == {"files"}
