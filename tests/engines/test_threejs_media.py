"""Media exported to three.js: the files, and what Node says of them."""

import json
import os
import subprocess

import numpy as np
import pytest
from media_bundles import box, fog, media_bundle, smoke

from rtgi_addon.exchange import engines

THREE = engines.get("threejs")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with fog, a box and smoke, as a report."""
    return THREE.export(media_bundle(), tmp_path_factory.mktemp("media") / "out")


def run(node, *words, cwd):
    ran = subprocess.run([node, *words], cwd=cwd, capture_output=True, text=True, timeout=120, check=False, env=os.environ)
    return ran.returncode, ran.stdout + ran.stderr


def test_files_and_notes(whole):
    assert {"rtgi/media.json", "rtgi/media.bin", "rtgi/RTGIMedia.js", "rtgi/RTGIMedia.d.ts", "media.mjs",
            "conformance/media.json", "conformance/kit_media.json"} <= set(whole.files)
    description = json.loads((whole.out / "rtgi/media.json").read_text())
    assert [box["blocks"] for box in description["boxes"]] == [1, 3] and description["everywhere"]
    assert np.allclose(description["extinction"], 0.05)
    assert (whole.out / "rtgi/media.bin").stat().st_size == description["data"]["bytes"]
    assert json.loads((whole.out / "demo.json").read_text())["media"] == "rtgi/media.json"
    assert any("Smoke: ambient light is scattered by the first moments of RAYLEIGH" in note for note in whole.notes)


def test_without_media_none_of_it(kit_bundle, tmp_path):
    report = THREE.export(kit_bundle, tmp_path / "out")
    assert not [name for name in report.files if "edia" in name] and not [note for note in report.notes if "medi" in note]


@pytest.mark.parametrize("media", [(fog(0.0, 0.1),), (box(), smoke())], ids=["glow", "boxes"])
def test_node_agrees_whatever_there_is(node, install_three, tmp_path, media):
    folder = install_three(THREE.export(media_bundle(*media), tmp_path / "out").out)
    code, said = run(node, "media.mjs", cwd=folder)
    assert code == 0 and "PASSED: all 4 comparisons" in said, said


@pytest.mark.parametrize(("old", "new"), [
    ("1.0925484 * x * z", "-1.0925484 * x * z"), ("moment * scattering", "scattering"), ("-Math.expm1(-depth) / depth", "1"),
    ("(number + jitter)", "(number + 0.6)"), ("sample(box, place, 1)", "sample(box, place, 0)")],
    ids=["a harmonic", "phase", "slices", "steps", "absorption"])
def test_node_finds_damage(node, install_three, whole, old, new):
    folder, script = whole.out, whole.out / "rtgi/RTGIMedia.js"
    if not (folder / "node_modules").exists():
        install_three(folder)
    text = script.read_text()
    assert old in text
    try:
        script.write_text(text.replace(old, new))
        code, said = run(node, "media.mjs", cwd=folder)
    finally:
        script.write_text(text)
    assert code == 1 and "FAIL" in said, said


def test_files_of_two_exports_are_no_pair(node, install_three, whole):
    if not (whole.out / "node_modules").exists():
        install_three(whole.out)
    binary = whole.out / "rtgi/media.bin"
    content = binary.read_bytes()
    try:
        binary.write_bytes(content[:-2])
        code, said = run(node, "media.mjs", cwd=whole.out)
    finally:
        binary.write_bytes(content)
    assert code == 1 and "copy both files of one export" in said
