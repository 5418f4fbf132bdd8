"""Lit voxels exported to three.js: the files, and what cones find in Chromium on a software GPU."""

import json

import numpy as np
import pytest
from voxel_bundles import lit_voxels, voxel_bundle

from rtgi_addon.exchange import engines

THREE = engines.get("threejs")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with voxels, as a report."""
    return THREE.export(voxel_bundle(), tmp_path_factory.mktemp("voxels") / "out")


def test_files(whole):
    assert {"rtgi/voxels.json", "rtgi/voxels.bin", "rtgi/RTGIVoxels.js", "rtgi/RTGIVoxels.d.ts", "conformance/voxels.json",
            "conformance/kit_voxels.json", "conformance/webgl_voxels.js"} <= set(whole.files)
    description = json.loads((whole.out / "rtgi/voxels.json").read_text())
    data = (whole.out / "rtgi/voxels.bin").read_bytes()
    width, height, depth = description["lists"]["rows"]["size"]
    rows = np.frombuffer(data[:4 * width * height * depth], "<f4")
    assert len(data) == description["data"]["bytes"] and int(rows.max()) == len(lit_voxels().tables.cells) - 1
    assert "9. Voxels" in (whole.out / "README.md").read_text()


def test_without_any_none_of_it(kit_bundle, tmp_path):
    assert not [name for name in THREE.export(kit_bundle, tmp_path / "out").files if "oxels" in name]


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
