"""Relighting exported to three.js: what Node says of it, and Chromium's WebGL."""

import json
import os
import subprocess

import numpy as np
import pytest
from transfer_bundles import transfer_bundle

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.transfer import engine_sky
from rtgi_addon.exchange.engines.transfer_conformance import kit_transfer
from rtgi_addon.scene import World
from rtgi_addon.techniques.transfer.controls import sun_towards
from rtgi_addon.techniques.transfer.lighting import sky_of, turned


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with transfer."""
    return engines.get("threejs").export(transfer_bundle(), tmp_path_factory.mktemp("relight") / "out").out


def run(node, *words, cwd):
    ran = subprocess.run([node, *words], cwd=cwd, capture_output=True, text=True, timeout=300, check=False, env=os.environ)
    return ran.returncode, ran.stdout + ran.stderr


def installed(folder, install_three):
    if not (folder / "node_modules").exists():
        install_three(folder)
    return folder


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_node_agrees(node, install_three, tmp_path, release):
    folder = install_three(engines.get("threejs").export(transfer_bundle(), tmp_path / "out").out, release)
    code, said = run(node, "relight.mjs", cwd=folder)
    assert code == 0 and "PASSED: all 24 comparisons" in said, said


@pytest.mark.parametrize(("old", "new", "failing"), [
    ("(1 - fu) * fv]", "(1 - fu) * fu]", "a sun at noon"),
    ("shares = [reach * ray[0]", "shares = [0.9 * reach * ray[0]", "as it was baked"),
    ("seen * basis * r", "basis * r", "a sky with bright spots"),
    ("replaced ? [0, 0, 0]", "false ? [0, 0, 0]", "an overcast sky"), ("y < 0 ? side * side : 0", "0", "a sun below the horizon"),
], ids=["shares", "deringing", "seen", "replaced", "below"])
def test_node_finds_damage(node, install_three, whole, old, new, failing):
    script = installed(whole, install_three) / "rtgi/RTGIRelight.js"
    text = script.read_text()
    assert old in text
    try:
        script.write_text(text.replace(old, new))
        code, said = run(node, "relight.mjs", cwd=whole)
    finally:
        script.write_text(text)
    assert code == 1 and f"FAIL  relit kit, {failing}" in said, said


def test_tables_of_another_export_are_refused(node, install_three, whole):
    binary = installed(whole, install_three) / "rtgi/transfer.bin"
    content = binary.read_bytes()
    try:
        binary.write_bytes(content[:-56])
        code, said = run(node, "relight.mjs", cwd=whole)
    finally:
        binary.write_bytes(content)
    assert code == 1 and "copy all files of one export" in said


def test_skies_and_suns_are_those_of_the_bake(node, install_three, whole, tmp_path):
    """`skyFrom` beside `sky_of`, and the sun by the hour beside the sliders'."""
    rng = np.random.default_rng(5)
    pixels = rng.uniform(0.0, 1.0, (8, 16, 3)).astype(np.float32)
    transfer = kit_transfer()
    # The bake takes texels by their middles, which is coarse for so few.
    fine = pixels[::-1].repeat(16, axis=0).repeat(16, axis=1)
    expected = engine_sky(sky_of(turned(World(fine), 30.0), transfer), Y_UP)
    (installed(whole, install_three) / "ask.mjs").write_text("""
import { readFileSync } from 'node:fs';
import { Color } from 'three';
import { RTGIProbeLoader } from './rtgi/RTGIProbeVolumes.js';
import { RTGIRelight, sunAt } from './rtgi/RTGIRelight.js';
const json = (name) => JSON.parse(readFileSync(name)), bytes = (name) => new Uint8Array(readFileSync(name)).buffer;
const probes = new RTGIProbeLoader().parse(json('rtgi/probes.json'), bytes('rtgi/probes.bin'));
const relight = new RTGIRelight(json('rtgi/transfer.json'), bytes('rtgi/transfer.bin'), probes);
const sky = relight.skyFrom(json('pixels.json'), 16, 8, 30);
const before = probes.irradiance(probes.position.clone(), probes.up).toArray();
relight.factors.Lamps = new Color(2, 0, 1);
let said = '';
try { relight.factors.Typo = 1; relight.update(); } catch (error) { said = error.message; }
delete relight.factors.Typo;
let updates = 1;
while (!relight.update()) { updates++; }
const after = probes.irradiance(probes.position.clone(), probes.up).toArray();
const idle = relight.update();
relight.dispose();
const again = probes.irradiance(probes.position.clone(), probes.up).toArray();
console.log(JSON.stringify({ sky, sun: sunAt(9.5).toArray(), said, updates, idle, before, after, again }));
""")
    (whole / "pixels.json").write_text(json.dumps([float(value) for value in pixels.ravel()]))
    code, said = run(node, "ask.mjs", cwd=whole)
    assert code == 0, said
    found = json.loads(said)
    assert np.abs(np.array(found["sky"]["harmonics"]) - expected["harmonics"]).max() < 2e-3
    assert np.abs(np.sum(found["sky"]["suns"], axis=0) - np.sum(expected["suns"], axis=0)).max() < 2e-3
    assert np.abs(np.array(found["sky"]["suns"]) - expected["suns"]).max() < 2e-3
    assert np.allclose(found["sun"], Y_UP.directions(sun_towards(9.5, 50.0, 172)), atol=1e-6)
    assert "there is no light \"Typo\": choose one of world, suns, Lamps" in found["said"]
    assert 2 <= found["updates"] <= 8 and found["idle"] and found["before"] == found["again"] != found["after"]


@pytest.mark.slow
@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_the_gpu_agrees(browse, install_three, tmp_path, release):
    folder = install_three(engines.get("threejs").export(transfer_bundle(), tmp_path / "out").out, release)
    page = browse(folder, "conformance.html?relight")
    assert page["state"] == "passed" and page["shown"].count("pass  relit") == 24, page
    assert not [message for message in page["messages"] if message.startswith("error")], page


@pytest.mark.slow
def test_the_gpu_agrees_through_nodes(browse, install_three, tmp_path):
    folder = install_three(engines.get("threejs").export(transfer_bundle(), tmp_path / "out").out)
    page = browse(folder, "conformance.html?relight-webgpu")
    assert page["state"] == "passed" and page["shown"].count("pass  relit") == 24, page
    assert not [message for message in page["messages"] if message.startswith("error")], page


@pytest.mark.slow
def test_the_demo_has_its_sliders(browse, install_three, tmp_path):
    folder = install_three(engines.get("threejs").export(transfer_bundle(), tmp_path / "out").out)
    page = browse(folder, "index.html", script="""(async () => {
        const form = document.querySelector('form');
        form.elements.hour.value = 12;
        form.dispatchEvent(new Event('input'));
        await new Promise((done) => setTimeout(done, 1500));
    })()""")
    assert page["state"] == "ready" and "12:0" in page["shown"] and "Lamps" in page["shown"], page


@pytest.mark.slow
def test_types_fit_three(node, node_modules, install_three, tmp_path):
    """The declarations against three's own, and a program that uses them."""
    export = install_three(engines.get("threejs").export(transfer_bundle(), tmp_path / "out").out)
    (export / "node_modules" / "@types").symlink_to(node_modules / "@types", target_is_directory=True)
    for name in ("@dimforge", "@tweenjs", "fflate", "meshoptimizer"):
        (export / "node_modules" / name).symlink_to(node_modules / name, target_is_directory=True)
    (export / "use.ts").write_text("""
import { Color, Vector3, WebGLRenderer } from 'three';
import { RTGIProbeLoader } from './rtgi/RTGIProbeVolumes.js';
import { RTGIRelight, loadRelight, sunAt } from './rtgi/RTGIRelight.js';
const relight: RTGIRelight = await loadRelight('rtgi/transfer.json', await new RTGIProbeLoader().loadAsync('rtgi/probes.json'));
relight.setSun(180, 40, new Color(3, 3, 3)).suns = [{ towards: sunAt(9, 50, 172, new Vector3()), irradiance: 2 }];
relight.factors.Lamps = [1, 0.5, 0];
relight.sky = relight.skyFrom(new Float32Array(6), 2, 1);
const followed: boolean = relight.update(new WebGLRenderer());
// @ts-expect-error: suns are not numbers
relight.suns = 3;
relight.finish().dispose();
console.log(followed);
""")
    code, said = run(node, str(node_modules / "typescript" / "bin" / "tsc"), "--noEmit", "--strict", "--module", "nodenext",
                     "--moduleResolution", "nodenext", "--target", "es2022", "--lib", "es2022,dom", "use.ts", cwd=export)
    assert code == 0, said
