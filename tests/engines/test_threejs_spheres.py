"""Sphere probes exported to three.js: the files, and what Node says of them. What materials show, test_threejs_pages.py sees."""

import json
import os
import subprocess

import pytest
from sphere_bundles import sphere_bundle

from rtgi_addon.exchange import engines

THREE = engines.get("threejs")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with two sphere probes, as a report."""
    return THREE.export(sphere_bundle(), tmp_path_factory.mktemp("spheres") / "out")


def run(node, *words, cwd):
    ran = subprocess.run([node, *words], cwd=cwd, capture_output=True, text=True, timeout=120, check=False, env=os.environ)
    return ran.returncode, ran.stdout + ran.stderr


def test_files(whole):
    assert {"rtgi/spheres.json", "rtgi/spheres.bin", "rtgi/RTGISpheres.js", "rtgi/RTGISpheres.d.ts", "spheres.mjs",
            "conformance/spheres.json", "conformance/kit_spheres.json"} <= set(whole.files)
    description = json.loads((whole.out / "rtgi/spheres.json").read_text())
    assert description["names"] == ["Ball", "Hall"] and len(description["table"]) == 64
    assert (whole.out / "rtgi/spheres.bin").stat().st_size == description["data"]["bytes"] == 2 * 170 * 34 * 4 * 2
    assert json.loads((whole.out / "demo.json").read_text())["spheres"] == "rtgi/spheres.json"
    assert "9. Mirrors" in (whole.out / "README.md").read_text()


def test_without_them_none_of_it(kit_bundle, tmp_path):
    report = THREE.export(kit_bundle, tmp_path / "out")
    assert not [name for name in report.files if "phere" in name]


def test_node_agrees(node, install_three, whole):
    code, said = run(node, "spheres.mjs", cwd=install_three(whole.out) if not (whole.out / "node_modules").exists() else whole.out)
    assert code == 0 and "PASSED: all 2 comparisons" in said, said


@pytest.mark.parametrize(("old", "new"), [
    ("alpha * reach / Math.max(away, 1e-12)", "alpha"), ("left -= share", "left -= 0"), ("[x, -z, y]", "[x, z, y]"),
    ("value + direction[axis] * reach - centre[axis]", "direction[axis]")], ids=["width", "weights", "axes", "parallax"])
def test_node_finds_damage(node, install_three, whole, old, new):
    folder, script = whole.out, whole.out / "rtgi/RTGISpheres.js"
    if not (folder / "node_modules").exists():
        install_three(folder)
    text = script.read_text()
    assert old in text
    try:
        script.write_text(text.replace(old, new))
        code, said = run(node, "spheres.mjs", cwd=folder)
        assert code == 1 and "FAIL" in said, said
    finally:
        script.write_text(text)
