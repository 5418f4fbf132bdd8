"""Lit voxels exported to three.js: the files, and what cones find in Chromium on a software GPU."""

import json
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from voxel_bundles import lit_voxels, voxel_bundle

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings

THREE = engines.get("threejs")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with voxels, as a report."""
    return THREE.export(voxel_bundle(), tmp_path_factory.mktemp("voxels") / "out")


def run(node, *words, cwd):
    ran = subprocess.run([node, *words], cwd=cwd, capture_output=True, text=True, timeout=120, check=False)
    return ran.returncode, ran.stdout + ran.stderr


def test_files(whole):
    assert {"rtgi/voxels.json", "rtgi/voxels.bin", "rtgi/RTGIVoxels.js", "rtgi/RTGIVoxels.d.ts", "conformance/voxels.json",
            "rtgi/voxel_lookup.js", "voxels.mjs", "conformance/kit_voxels.json", "conformance/webgl_voxels.js"} <= set(whole.files)
    description = json.loads((whole.out / "rtgi/voxels.json").read_text())
    data = (whole.out / "rtgi/voxels.bin").read_bytes()
    width, height, depth = description["lists"]["rows"]["size"]
    rows = np.frombuffer(data[:4 * width * height * depth], "<f4")
    assert len(data) == description["data"]["bytes"] and int(rows.max()) == len(lit_voxels().tables.cells) - 1
    assert "9. Voxels" in (whole.out / "README.md").read_text()


def test_without_any_none_of_it(kit_bundle, tmp_path):
    assert not [name for name in THREE.export(kit_bundle, tmp_path / "out").files if "oxels" in name]


def test_grids_are_named_where_they_lie_in_the_world(tmp_path):
    report = THREE.export(replace(voxel_bundle(), voxels=lit_voxels(2)), tmp_path / "out", ExportSettings(part="files"))
    inner, outer = json.loads((report.out / "rtgi/voxels.json").read_text())["cascades"]
    grid = lit_voxels(2).tables.grids[0]
    assert outer["cell"] == 2.0 * inner["cell"] == 2.0 * grid.cell and inner["resolution"] == list(grid.resolution)
    (x, y, z), (right, back, top) = grid.corner, grid.high
    assert inner["low"] == pytest.approx([x, z, -back]) and inner["high"] == pytest.approx([right, top, -y])


@pytest.fixture(scope="module")
def installed(whole, install_three):
    return install_three(whole.out)


def test_node_agrees(node, installed):
    code, said = run(node, "voxels.mjs", cwd=installed)
    assert code == 0 and "PASSED: all 2 comparisons" in said, said


@pytest.mark.parametrize(("old", "new", "case"), [
    ("numbers.CONE_TIGHT * met.share", "0.5 * met.share", "bundle, voxels"), ("adds = level > grid", "adds = false", "kit, voxels"),
    ("numbers.VOXEL_OWN_PLANE ? 0 : cut", "numbers.VOXEL_OWN_PLANE ? cut : cut", "bundle, voxels"),
    ("level - grid) - (", "level - grid) + 0 * (", "kit, voxels")], ids=["sheets", "adding", "own plane", "origins"])
def test_node_finds_damage(node, installed, old, new, case):
    script = installed / "rtgi/voxel_lookup.js"
    text = script.read_text()
    assert old in text
    try:
        script.write_text(text.replace(old, new))
        code, said = run(node, "voxels.mjs", cwd=installed)
        assert code == 1 and f"FAIL  {case}" in said, said
    finally:
        script.write_text(text)


@pytest.mark.slow
@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_the_gpu_agrees_and_finds_damage(browse, install_three, tmp_path, release):
    folder = install_three(THREE.export(voxel_bundle(), tmp_path / "out").out, release)
    page = browse(folder, "conformance.html?voxels")
    assert page["state"] == "passed" and page["shown"].count("pass  ") == 4, page
    assert not [message for message in page["messages"] if message.startswith("error")], page
    script = folder / "rtgi/voxels.json"
    whole = script.read_text()
    assert "RTGI_CONE_TIGHT * met.share" in whole
    script.write_text(whole.replace("RTGI_CONE_TIGHT * met.share", "0.5 * met.share"))
    page = browse(folder, "conformance.html?voxels")
    assert page["state"] == "failed" and "FAIL  bundle, voxels, shader" in page["shown"], page
