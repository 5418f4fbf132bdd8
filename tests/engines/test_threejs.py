"""The export to three.js: its files, and what Node says of them."""

import json
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.effects.stylized.settings import StylizedSettings
from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines import ExportSettings, threejs
from rtgi_addon.numerics import sh
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.lattice.field import ProbeField

THREE = engines.get("threejs")
TESTS = Path(__file__).parent / "threejs"


def run(node, *words, cwd, **environment):
    """Exit code and everything said."""
    ran = subprocess.run([node, *map(str, words)], cwd=cwd, capture_output=True, text=True, timeout=120, check=False,
                         env={**os.environ, **environment})
    return ran.returncode, ran.stdout + ran.stderr


def read_probes(folder):
    """The description, the texels (p, 9, 4) of all probes and the numbers after them."""
    description, data = json.loads((folder / "rtgi/probes.json").read_text()), (folder / "rtgi/probes.bin").read_bytes()
    assert len(data) == description["data"]["bytes"]
    count = sum(volume.get("probes", int(np.prod(volume["resolution"]))) for volume in description["volumes"])
    texels = np.frombuffer(data, "<f2", count * 36).reshape(count, 9, 4).astype(np.float64)
    return description, texels, np.frombuffer(data, "<u2", offset=count * 72)


def test_every_name_finds_it():
    assert engines.get("three") is THREE and engines.get("three.js") is THREE and "threejs" in engines.names()


def test_files(export):
    names = {path.relative_to(export).as_posix() for path in export.rglob("*") if path.is_file()}
    assert {"README.md", "index.html", "demo.js", "package.json", "rtgi/probes.json", "rtgi/probes.bin", "rtgi/RTGIProbeVolumes.js",
            "rtgi/RTGIProbeVolumes.d.ts", "rtgi/weights.js", "conformance.mjs", "conformance.html",
            "conformance/conformance.json"} <= names
    assert json.loads((export / "demo.json").read_text()) == {"model": None}
    assert len((export / "README.md").read_text().strip().splitlines()) <= 12


def test_every_file_that_a_page_names_is_there(export):
    for page in ("index.html", "demo.js", "conformance/webgl.js", "conformance/webgpu.js", "conformance.mjs",
                 "rtgi/RTGIProbeVolumes.js", "rtgi/RTGIProbeLight.js", "rtgi/shader.js"):
        text = (export / page).read_text()
        for name in re.findall(r"""(?:from|src=)\s*['"](\.[^'"]+)['"]""", text):
            assert ((export / page).parent / name).is_file(), f"{page} names {name}"


def test_without_the_kit(kit_bundle, tmp_path):
    report = THREE.export(kit_bundle, tmp_path / "out", ExportSettings(conformance=False))
    assert "rtgi/probes.bin" in report.files and not [name for name in report.files if "conformance" in name]


def test_the_model_goes_along(kit_bundle, tmp_path):
    model = tmp_path / "Any Name.glb"
    model.write_bytes(b"glTF and so on")
    report = THREE.export(kit_bundle, tmp_path / "out", ExportSettings(model=model))
    assert (report.out / "model.glb").read_bytes() == b"glTF and so on"
    assert json.loads((report.out / "demo.json").read_text()) == {"model": "model.glb"}


def test_a_second_export_leaves_packages_and_pages_alone(kit_bundle, export):
    (export / "node_modules" / "three").mkdir(parents=True)
    (export / "node_modules" / "three" / "package.json").write_text("{}")
    (export / "package-lock.json").write_text("{}")
    (export / "mine.js").write_text("")
    before = {path: path.read_bytes() for path in export.rglob("*") if path.is_file()}
    assert THREE.export(kit_bundle, export).kept == ()
    assert {path: path.read_bytes() for path in export.rglob("*") if path.is_file()} == before


def test_coefficients_are_those_of_the_same_light_with_y_up(export, kit_bundle):
    """Independent of axes.py: the light of a direction is the same in both files."""
    description, texels, _ = read_probes(export)
    first, rng = 0, np.random.default_rng(1)
    for volume in description["volumes"]:
        count = volume.get("probes", int(np.prod(volume["resolution"])))
        lookup = next(item for item in ProbeField(kit_bundle.grids).lookups if item.volume.name == volume["name"])
        blender = rng.normal(size=(50, 3))
        blender /= np.linalg.norm(blender, axis=1, keepdims=True)
        three = np.stack([blender[:, 0], blender[:, 2], -blender[:, 1]], axis=1)
        ours = np.einsum("nk,pkc->pnc", sh.evaluate(blender, 2), lookup.coefficients)
        theirs = np.einsum("nk,pkc->pnc", sh.evaluate(three, 2), texels[first:first + count, :, :3])
        assert np.abs(theirs - ours).max() < 2e-3 * np.abs(ours).max()
        np.testing.assert_array_equal(texels[first:first + count, 3, 3] != 0.0, lookup.live)
        first += count


def test_distances_are_kept_to_a_step(export, kit_bundle):
    description, _, stored = read_probes(export)
    for volume in description["volumes"]:
        grid = next(item for item in kit_bundle.grids if item.volume.name == volume["name"])
        found, stored = stored[:grid.visibility.size] * volume["distanceStep"], stored[grid.visibility.size:]
        mean, deviation = np.moveaxis(found.reshape(grid.visibility.shape), -1, 0)
        assert np.abs(mean - grid.visibility[..., 0]).max() <= 0.51 * volume["distanceStep"]
        assert np.abs(deviation**2 + mean**2 - grid.visibility[..., 1]).max() < 4 * volume["distanceStep"] * mean.max()
    words = np.concatenate([grid.volume.scattered.index.ravel() for grid in kit_bundle.grids if grid.volume.scattered is not None])
    assert np.array_equal(stored.view("<f4"), words)


def test_light_beyond_halves_is_refused(kit_bundle, tmp_path):
    grids = tuple(replace(grid, sh=grid.sh * 1e5) for grid in kit_bundle.grids)
    with pytest.raises(BakeError, match="brighter than half floats hold"):
        THREE.export(replace(kit_bundle, grids=grids), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_more_volumes_than_a_shader_holds_are_refused(kit_bundle, tmp_path):
    with pytest.raises(BakeError, match="17 volumes are more than the 16"):
        THREE.export(replace(kit_bundle, grids=(kit_bundle.grids[0],) * 17), tmp_path / "out")


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_node_agrees(node, install_three, export, release):
    code, said = run(node, "conformance.mjs", cwd=install_three(export, release))
    assert code == 0 and said.count("pass  ") == 9 and "PASSED: all 9" in said, said


def test_node_reads_fitted_probes_as_we_read_them(node, install_three, tmp_path):
    """Coefficients and distances that a fit moved, in the 16 bits in which the export holds them."""
    lattice = build.volume(resolution=(3, 3, 3), half_size=1.0)
    room = replace(build.closed_box(0.7, light_position=(0.3, -0.2, 0.5)), volumes=(lattice,))
    probes = techniques.get("probes")
    grids = probes.bake(room, probes.Settings(error=0.1, fit=True), np.random.default_rng(1), Progress()).grids()
    assert grids[0].fitted
    bundle = Bundle(Path("fitted"), {"scene": "fitted", "includes_direct": False}, grids)
    code, said = run(node, "conformance.mjs", cwd=install_three(THREE.export(bundle, tmp_path / "out").out))
    assert code == 0 and "pass  bundle" in said and "FAIL" not in said, said


def swapped_channels(texels):
    texels[..., :3] = texels[..., [1, 0, 2]]


def negated_coefficient(texels):
    texels[:, 5, :3] *= -1


def revived_probes(texels):
    texels[:, 3, 3] = 1


def unmoved_probes(texels):
    texels[:, :3, 3] = 0


@pytest.mark.parametrize("damage", [swapped_channels, negated_coefficient, revived_probes, unmoved_probes])
def test_node_finds_damage(node, install_three, export, damage):
    """The kit is sensitive to everything that it claims to hold."""
    path = install_three(export) / "conformance" / "kit.bin"
    data = path.read_bytes()
    texels = np.frombuffer(data, "<f2", 36 * _kit_probes(export)).reshape(-1, 9, 4).copy()
    damage(texels)
    path.write_bytes(texels.tobytes() + data[texels.nbytes:])
    code, said = run(node, "conformance.mjs", cwd=export)
    assert code == 1 and "FAIL  visibility: 200 points" in said and "pass  bundle" in said and "FAILED" in said, said


def test_node_finds_distances_that_are_off(node, install_three, export):
    path = install_three(export) / "conformance" / "kit.bin"
    data = path.read_bytes()
    start = 72 * _kit_probes(export)
    path.write_bytes(data[:start] + (np.frombuffer(data, "<u2", offset=start) // 2).astype("<u2").tobytes())
    code, said = run(node, "conformance.mjs", cwd=export)
    assert code == 1 and "FAIL  visibility" in said and "FAIL  light probe" in said, said


def _kit_probes(folder):
    kit = json.loads((folder / "conformance" / "kit.json").read_text())
    return sum(volume.get("probes", int(np.prod(volume["resolution"]))) for volume in kit["volumes"])


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_what_the_loader_promises(node, install_three, export, release):
    install_three(export, release)
    code, said = run(node, "--test", "--test-timeout=30000", TESTS / "loader.test.mjs", cwd=export, EXPORT=str(export))
    assert code == 0 and re.search(r"^# pass [1-9]", said, re.MULTILINE), said


@pytest.mark.slow
def test_types_fit_three(node, node_modules, install_three, kit_bundle, tmp_path):
    """The declarations against three's own, and a program that uses them."""
    export = install_three(THREE.export(kit_bundle, tmp_path / "export", ExportSettings(style=StylizedSettings())).out)
    # Exports have these where there are sphere probes and a light atlas.
    for name in ("RTGISpheres.d.ts", "RTGIAtlas.d.ts", "RTGIVoxels.d.ts"):
        shutil.copy(Path(threejs.__file__).parent / "export/rtgi" / name, export / "rtgi")
    (export / "node_modules" / "@types").symlink_to(node_modules / "@types", target_is_directory=True)
    for name in ("@dimforge", "@tweenjs", "fflate", "meshoptimizer"):
        (export / "node_modules" / name).symlink_to(node_modules / name, target_is_directory=True)
    (export / "use.ts").write_text("""
import { Camera, Color, Mesh, MeshStandardMaterial, Scene, SphericalHarmonics3, Vector3, WebGLRenderer } from 'three';
import { RTGIProbeLight } from './rtgi/RTGIProbeLight.js';
import { RTGIStyle, RTGIStyleView, loadStyle } from './rtgi/RTGIStyle.js';
import { RTGILightProbe, RTGIProbeLoader, RTGIProbeVolumes } from './rtgi/RTGIProbeVolumes.js';
import { loadSpheres } from './rtgi/RTGISpheres.js';
import { loadAtlas } from './rtgi/RTGIAtlas.js';
const scene = new Scene();
const probes: RTGIProbeVolumes = await new RTGIProbeLoader().loadAsync('rtgi/probes.json');
probes.addMirrors(await loadSpheres('rtgi/spheres.json')).addAtlas(await loadAtlas('rtgi/atlas.json')).addMirrors(null);
scene.add(probes.apply(new Mesh(undefined, new MeshStandardMaterial())));
const light = new RTGILightProbe(probes, 2).update(new Vector3());
scene.add(light);
const e: Color = probes.irradiance(new Vector3(), new Vector3(0, 1, 0));
const sh: SphericalHarmonics3 = probes.radiance(e && new Vector3(), light.sh);
probes.forEachProbe((position, live, volume) => { if (live) console.log(position.x, probes.volumes[volume].count, sh); });
probes.intensity = 2;
scene.add(probes, new RTGIProbeLight(probes));
const style: RTGIStyle = (await loadStyle('rtgi/style.json')).apply(scene);
new RTGIStyleView(style).render(new WebGLRenderer(), scene, new Camera(), (renderer, what, eye) => renderer.render(what, eye));
style.release(scene).dispose();
// @ts-expect-error: a number is no material
probes.apply(3);
probes.dispose();
""")
    code, said = run(node, node_modules / "typescript" / "bin" / "tsc", "--noEmit", "--strict", "--module", "nodenext",
                     "--moduleResolution", "nodenext", "--target", "es2022", "--lib", "es2022,dom", "use.ts", cwd=export)
    assert code == 0, said
