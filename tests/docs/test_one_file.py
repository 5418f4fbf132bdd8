"""CONTRIBUTING says that a technique, an effect and an engine are one file each: its own examples are dropped into a copy of the
package."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = re.findall(r"```python\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.DOTALL)
SHADER = re.search(r"```text\n(#include \"include/effect.glsl\".*?)```", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"),
                   re.DOTALL)[1]
COPIED = ("rtgi_addon", "tests/techniques/test_matrix.py", "tests/effects/test_every_effect.py", "tests/gpu/test_every_effect.py",
          "tests/exchange/engines", "tests/support", "tests/conftest.py", "pyproject.toml")


def example(name):
    """The one example that ends in ``name = …``."""
    found = [text for text in EXAMPLES if re.search(rf"^{name} = ", text, re.MULTILINE)]
    assert len(found) == 1
    return found[0]


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The package and what tests it, with the examples in place and nothing else changed."""
    root = tmp_path_factory.mktemp("copy")
    for name in COPIED:
        source, target = ROOT / name, root / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__", "node_modules"))
        else:
            shutil.copyfile(source, target)
    (root / "rtgi_addon/techniques/paths.py").write_text(example("TECHNIQUE"), encoding="utf-8")
    (root / "rtgi_addon/effects/zebra.py").write_text(example("EFFECT"), encoding="utf-8")
    (root / "rtgi_addon/exchange/engines/plain.py").write_text(example("ENGINE"), encoding="utf-8")
    return root


def run(root, *words):
    ran = subprocess.run([sys.executable, *map(str, words)], cwd=root, capture_output=True, text=True, timeout=600, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


@pytest.mark.slow
def test_the_matrix_of_techniques_runs_the_new_one(copy):
    said = run(copy, "-m", "pytest", "-q", "tests/techniques/test_matrix.py", "-k", "paths")
    assert re.search(r"\b9 passed", said)


def test_the_tests_of_engines_run_the_new_one(copy):
    said = run(copy, "-m", "pytest", "-q", "tests/exchange/engines/test_every_engine.py", "-k", "plain")
    assert " passed" in said and "failed" not in said


def test_the_tests_of_effects_run_the_new_one(copy):
    said = run(copy, "-m", "pytest", "-q", "tests/effects/test_every_effect.py", "-k", "zebra")
    assert re.search(r"\b7 passed", said)


@pytest.mark.parametrize("shader", [False, True])
def test_the_preview_runs_the_new_effect_with_and_without_a_shader(copy, gpu_device, shader):
    file = copy / "rtgi_addon/shaders/effect_zebra.comp.glsl"
    if shader:
        file.write_text(SHADER, encoding="utf-8")
    try:
        said = run(copy, "-m", "pytest", "-q", "tests/gpu/test_every_effect.py", "-k", "zebra")
    finally:
        file.unlink(missing_ok=True)
    assert " passed" in said and "skipped" not in said


PANEL = """
import bpy, json, rtgi_addon
rtgi_addon.register()
rtgi = bpy.context.scene.rtgi
rtgi.technique = "paths"
rtgi.use_preset("final")
probe = bpy.data.lightprobes.new("Probes", "VOLUME")
engines = bpy.context.scene.rtgi_export.bl_rna.properties["engine"].enum_items.keys()
techniques = rtgi.bl_rna.properties["technique"].enum_items.keys()
effects = bpy.context.scene.rtgi_effects
print("FOUND", json.dumps([rtgi.technique_paths.paths, probe.rtgi.technique_paths.override_paths, techniques, engines,
                           [effects.use_effect_zebra, effects.effect_zebra.width, bpy.types.RTGI_PT_use_effect_zebra.bl_label]]))
rtgi_addon.unregister()
"""


def test_panel_presets_and_overrides_have_them(copy):
    pytest.importorskip("bpy", reason="needs Blender's Python module")
    said = run(copy, "-c", PANEL)
    found = next(line[6:] for line in said.splitlines() if line.startswith("FOUND"))
    paths, override, techniques, engines, effect = json.loads(found)
    assert paths == 4096 and override is False and "paths" in techniques and "plain" in engines
    assert effect == [False, 4, "Zebra"]


def test_the_shell_bakes_and_exports_with_them(copy, tiny_scene, tmp_path):
    bundle, out = tmp_path / "bundle", tmp_path / "plain"
    run(copy, "-m", "rtgi_addon", tiny_scene, "bake", "--technique", "paths", "--preset", "draft", "--out", bundle)
    manifest = json.loads((bundle / "bake.json").read_text())
    assert manifest["technique"] == "paths" and manifest["settings"] == {"paths": 32}
    run(copy, "-m", "rtgi_addon", "export", bundle, "--engine", "plain", "--out", out)
    written = json.loads((out / "Probes.json").read_text())
    assert written["resolution"] == [2, 2, 2] and len(written["radiance"][0][0][0]) == 9
    assert "paths" in run(copy, "-m", "rtgi_addon", "chart", "--help")
    assert "stylized, zebra" in " ".join(run(copy, "-m", "rtgi_addon", "render", "--help").split())
