"""The light atlas exported to three.js: the files, and what Node says of them. What materials show, test_threejs_pages.py sees."""

import json
import os
import subprocess

import pytest
from atlas_bundles import atlas_bundle, relit_atlas_bundle

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import atlas_transfer
from rtgi_addon.exchange.engines.base import ExportSettings

THREE = engines.get("threejs")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with a light atlas, as a report."""
    return THREE.export(atlas_bundle(), tmp_path_factory.mktemp("atlas") / "out")


def run(node, *words, cwd):
    ran = subprocess.run([node, *words], cwd=cwd, capture_output=True, text=True, timeout=120, check=False, env=os.environ)
    return ran.returncode, ran.stdout + ran.stderr


def test_files(whole):
    assert {"rtgi/atlas.json", "rtgi/atlas.bin", "rtgi/RTGIAtlas.js", "rtgi/RTGIAtlas.d.ts", "atlas.mjs", "conformance/atlas.json",
            "conformance/kit_atlas.json", "conformance/webgl_atlas.js"} <= set(whole.files)
    description = json.loads((whole.out / "rtgi/atlas.json").read_text())
    assert [part["name"] for part in description["parts"]] == ["Floor.001", "Wall"] and description["size"] == [32, 24]
    assert (whole.out / "rtgi/atlas.bin").stat().st_size == description["data"]["bytes"] == 3 * 24 * 32 * 4 * 2
    assert json.loads((whole.out / "demo.json").read_text())["atlas"] == "rtgi/atlas.json"
    assert "9. Light atlas" in (whole.out / "README.md").read_text()


def test_without_one_none_of_it(kit_bundle, tmp_path):
    report = THREE.export(kit_bundle, tmp_path / "out")
    assert not [name for name in report.files if "tlas" in name]


def test_node_agrees_and_finds_damage(node, install_three, whole):
    folder, script = install_three(whole.out), whole.out / "rtgi/RTGIAtlas.js"
    code, said = run(node, "atlas.mjs", cwd=folder)
    assert code == 0 and "PASSED: all 2 comparisons" in said, said
    text = script.read_text()
    for old, new in (("1.0233267 * y, 1.0233267 * z", "1.0233267 * z, 1.0233267 * y"), ("+ offset[0] - 0.5", "+ offset[0]"),
                     ("within(value + 1, axis)", "within(value, axis)")):
        assert old in text
        script.write_text(text.replace(old, new))
        code, said = run(node, "atlas.mjs", cwd=folder)
        assert code == 1 and "FAIL" in said, (old, said)
    script.write_text(text)


@pytest.fixture(scope="module")
def relit(tmp_path_factory):
    """An export whose light atlas follows light, as a report."""
    return THREE.export(relit_atlas_bundle(), tmp_path_factory.mktemp("relit") / "out")


def test_node_follows_light_and_finds_damage(node, install_three, relit):
    assert {"rtgi/atlas_transfer.bin", "conformance/kit_atlas_transfer.bin", "atlas_relight.mjs"} <= set(relit.files)
    assert any("relighting the light atlas takes 0.7 MiB of tables, 0.9 kB a texel" in note for note in relit.notes)
    folder = install_three(relit.out)
    code, said = run(node, "atlas_relight.mjs", cwd=folder)
    assert code == 0 and "PASSED: all 24 comparisons" in said, said
    for file, old, new in (("RTGIAtlas.js", "first + 3", "first"), ("RTGIRelight.js", "result[node][channel] += share * part",
                                                                       "result[node][channel] += part")):
        script, text = relit.out / "rtgi" / file, (relit.out / "rtgi" / file).read_text()
        assert old in text
        script.write_text(text.replace(old, new))
        code, said = run(node, "atlas_relight.mjs", cwd=folder)
        script.write_text(text)
        assert code == 1 and "FAIL  relit kit atlas, a sky with bright spots" in said, (old, said)


def test_tables_that_no_game_should_hold_are_left_out(monkeypatch, tmp_path):
    monkeypatch.setattr(atlas_transfer, "MOST_BYTES", 1000)
    report = THREE.export(relit_atlas_bundle(), tmp_path / "out", ExportSettings(conformance=False))
    assert any("keeps the light of the bake: to follow others it would take" in note for note in report.notes)
    assert "rtgi/atlas_transfer.bin" not in report.files and "rtgi/atlas.bin" in report.files


@pytest.mark.slow
@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_the_gpu_follows_light(browse, install_three, tmp_path, release):
    folder = install_three(THREE.export(relit_atlas_bundle(), tmp_path / "out").out, release)
    page = browse(folder, "conformance.html?relight")
    assert page["state"] == "passed" and page["shown"].count("pass  relit") == 48, page
    assert not [message for message in page["messages"] if message.startswith("error")], page
