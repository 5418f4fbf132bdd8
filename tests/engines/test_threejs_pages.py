"""The pages of an export to three.js, in Chromium on a software GPU: the conformance page, and the demo beside our own picture."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from atlas_bundles import atlas_bundle
from engine_pictures import atrium, keep, through_our_filter
from media_bundles import media_bundle
from sphere_bundles import sphere_bundle

from rtgi_addon.effects.stylized.settings import StylizedSettings
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[2]


def rtgi(sample, *words):
    """Run a subcommand on a sample, or a file."""
    file = sample if isinstance(sample, Path) else ROOT / "sample_blends" / f"{sample}.blend"
    ran = subprocess.run([sys.executable, "-m", "rtgi_addon", file, *map(str, words)], cwd=ROOT, capture_output=True, text=True,
                         timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_the_gpu_agrees(browse, install_three, export, release):
    page = browse(install_three(export, release), "conformance.html")
    assert page["state"] == "passed" and page["shown"].count("pass  ") == 16, page
    assert not [message for message in page["messages"] if message.startswith("error")], page


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_the_gpu_agrees_on_mirrors(browse, install_three, tmp_path, release):
    folder = install_three(engines.get("threejs").export(sphere_bundle(), tmp_path / "mirrors").out, release)
    page = browse(folder, "conformance.html")
    assert page["state"] == "passed" and page["shown"].count("pass  ") == 20, page
    assert "pass  kit, sphere probes, shader" in page["shown"], page
    assert not [message for message in page["messages"] if message.startswith("error")], page
    assert browse(folder, "index.html")["state"] == "ready"


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_the_gpu_agrees_on_the_atlas(browse, install_three, tmp_path, release):
    folder = install_three(engines.get("threejs").export(atlas_bundle(), tmp_path / "atlas").out, release)
    page = browse(folder, "conformance.html")
    assert page["state"] == "passed" and page["shown"].count("pass  ") == 20, page
    assert "pass  bundle, light atlas, material" in page["shown"], page
    assert not [message for message in page["messages"] if message.startswith("error")], page
    assert browse(folder, "index.html")["state"] == "ready"


@pytest.mark.parametrize(("webgpu", "device"), [(True, "on WebGPU"), (False, "on WebGL 2 in place of WebGPU")])
def test_the_gpu_agrees_through_nodes(browse, install_three, export, webgpu, device):
    page = browse(install_three(export), "conformance.html?webgpu", webgpu=webgpu)
    assert page["state"] == "passed" and page["shown"].count("pass  ") == 14, page
    if webgpu and device not in page["shown"]:
        pytest.skip("this Chromium has no WebGPU in software; WebGL 2 took its place")
    assert device in page["shown"], page
    assert not [message for message in page["messages"] if message.startswith("error")], page


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_the_lines_of_a_style_are_the_effects(browse, install_three, kit_bundle, tmp_path, release):
    settings = ExportSettings(style=StylizedSettings())
    folder = install_three(engines.get("threejs").export(kit_bundle, tmp_path / "styled", settings).out, release)
    page = browse(folder, "style.html")
    assert page["state"] == "passed" and "pass  lines: " in page["shown"], page
    assert browse(folder, "index.html")["state"] == "ready"
    script = folder / "rtgi" / "style.json"
    style = folder / "conformance" / "style" / "style.json"
    style.write_text(script.read_text().replace('"lines": true', '"lines": false'))
    assert browse(folder, "style.html")["state"] == "failed"


@pytest.mark.parametrize(("file", "text", "wrong", "failing"), [
    ("weights.js", "return share * share;", "return 1.0;", "visibility"),
    ("weights.js", "RTGI_CRUSH_BELOW 0.2", "RTGI_CRUSH_BELOW 0.21", "weights"),
    ("shader.js", "rtgiNormal(nonPerturbedNormal)", "rtgiNormal(normal)", "weights"),
    ("shader.js", "word > 0.0, offset", "true, offset", "scattered"),
], ids=["seen share", "a number", "normals", "stand-ins"])
def test_the_gpu_finds_damage(browse, install_three, export, file, text, wrong, failing):
    """The page fails where the shader does."""
    shader = install_three(export) / "rtgi" / file
    whole = shader.read_text()
    assert text in whole
    shader.write_text(whole.replace(text, wrong))
    page = browse(export, "conformance.html")
    assert page["state"] == "failed" and f"FAIL  {failing}" in page["shown"] and "pass  light probe" in page["shown"], page


@pytest.mark.parametrize("page", ["index.html", "conformance.html"])
def test_without_three_the_pages_say_what_to_do(browse, export, page):
    shown = browse(export, page)
    assert shown["state"] == "failed" and "npm install" in shown["shown"], shown


def test_without_a_model_balls_show_the_probes(browse, install_three, export, tmp_path):
    page = browse(install_three(export), "index.html", picture=str(tmp_path / "picture.raw"))
    assert page["state"] == "ready" and not [text for text in page["messages"] if text.startswith("error")], page
    picture = np.fromfile(tmp_path / "picture.raw", np.float32)
    assert np.isfinite(picture).all() and (picture > 0.01).mean() > 0.05


@pytest.mark.parametrize(("sample", "width", "height", "bake", "shown", "mean"), [
    # All light is in the probes, and area lamps are no part of glTF.
    ("cornell_box", 480, 480, ["--direct"], "indirect", 0.01),
    # The sun is the model's own, with a shadow map.
    ("sun_window", 640, 360, [], "combined", 0.03),
])
def test_the_demo_beside_our_picture(gpu_device, browse, install_three, tmp_path, sample, width, height, bake, shown, mean):
    """Relative differences in linear light from the scene's camera: the mean holds edges, the median what halves leave."""
    import bpy

    from rtgi_addon.exchange.exr import read_exr
    if not bpy.app.module:
        pytest.skip("the module's door needs the module: this is a real Blender")
    rtgi(sample, "bake", *bake, "--out", tmp_path / "bundle", "--rays", 256)
    rtgi(sample, "export", tmp_path / "bundle", "--engine", "threejs", "--out", tmp_path / "export")
    page = browse(install_three(tmp_path / "export"), "index.html", width, height, picture=str(tmp_path / "three.raw"),
                  screenshot=str(tmp_path / "three.png"))
    assert page["state"] == "ready" and not [text for text in page["messages"] if text.startswith("error")], page
    theirs = np.fromfile(tmp_path / "three.raw", np.float32).reshape(height, 2, width, 2, 3).mean(axis=(1, 3))[::-1]
    rtgi(sample, "render", "--bundle", tmp_path / "bundle", "--pass", shown, "--samples", 4, "--out", tmp_path / "ours.exr")
    planes, _ = read_exr(tmp_path / "ours.exr")
    ours = np.stack([planes[name] for name in "RGB"], axis=-1)
    keep(f"{sample} in three beside our own", np.concatenate([theirs, np.zeros_like(ours[:, :8]), ours], axis=1))
    # The page has no background.
    surface = (ours.min(axis=-1) > 0.0) & (theirs.min(axis=-1) > 0.0)
    assert surface.mean() > 0.8
    difference, brightness = np.abs(theirs - ours)[surface], ours[surface].mean()
    assert difference.mean() < mean * brightness
    assert np.median(difference) < 1e-3 * brightness
    assert abs(theirs[surface].mean() / brightness - 1.0) < 0.01


def test_the_demo_shows_the_atlas(empty_blend, browse, install_three, tmp_path):
    """A room and its blocks, unwrapped by the operator, found in the glTF by their names: as a picture by rays has them, lamp and
    all, within what texels of six centimetres leave, where probes are twice as far off."""
    import bpy

    import rtgi_addon
    from rtgi_addon.exchange.exr import read_exr
    size, file = 160, tmp_path / "room.blend"
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends/cornell_box.blend"), load_ui=False)
    rtgi_addon.register()
    try:
        render = bpy.context.scene.render
        render.resolution_x = render.resolution_y = size
        bpy.context.scene.rtgi.atlas.density = 16.0
        for obj in bpy.context.scene.objects:
            obj.select_set(obj.type == "MESH")
        bpy.context.view_layer.objects.active = bpy.context.scene.objects["Room"]
        bpy.ops.rtgi.unwrap_atlas()
        bpy.ops.wm.save_as_mainfile(filepath=str(file))
    finally:
        rtgi_addon.unregister()
    rtgi(file, "bake", "--direct", "--rays", 256, "--set", "atlas.density=16", "--out", tmp_path / "bundle")
    rtgi(file, "export", tmp_path / "bundle", "--engine", "threejs", "--no-conformance", "--out", tmp_path / "export")
    rtgi(file, "render", "--gather", "rays", "--picture-error", 0.05, "--out", tmp_path / "ours.exr")
    planes, _ = read_exr(tmp_path / "ours.exr")
    ours, off = np.stack([planes[name] for name in "RGB"], axis=-1), {}
    for name in ("atlas", "probes"):
        page = browse(install_three(tmp_path / "export") if name == "atlas" else tmp_path / "export", "index.html", size, size,
                      picture=str(tmp_path / "three.raw"))
        assert page["state"] == "ready" and not [text for text in page["messages"] if text.startswith("error")], page
        theirs = np.fromfile(tmp_path / "three.raw", np.float32).reshape(size, 2, size, 2, 3).mean(axis=(1, 3))[::-1]
        keep(f"cornell_box in three by its {name}", np.concatenate([theirs, np.zeros_like(ours[:, :4]), ours], axis=1))
        off[name] = np.median(np.abs(theirs - ours).sum(axis=-1)) / np.median(ours.sum(axis=-1))
        demo = json.loads((tmp_path / "export/demo.json").read_text())
        (tmp_path / "export/demo.json").write_text(json.dumps({key: value for key, value in demo.items() if key != "atlas"}))
    assert off["atlas"] < 0.06 and off["atlas"] < 0.6 * off["probes"], off


def test_the_atrium_is_the_baked_scene(empty_blend, browse, install_three, tmp_path):
    """Banners that share a mesh and link their own cloth, pebbles that geometry nodes instance, and the sky: as in our picture, all
    light from the probes."""
    from rtgi_addon.exchange.exr import read_exr
    size, file = 240, atrium(tmp_path, 240)
    rtgi(file, "bake", "--direct", "--rays", 64, "--order", 1, "--bounces", 1, "--out", tmp_path / "bundle")
    rtgi(file, "export", tmp_path / "bundle", "--engine", "threejs", "--no-conformance", "--out", tmp_path / "export")
    page = browse(install_three(tmp_path / "export"), "index.html", 2 * size, 2 * size, picture=str(tmp_path / "three.raw"))
    assert page["state"] == "ready" and not [text for text in page["messages"] if text.startswith("error")], page
    drawn = np.fromfile(tmp_path / "three.raw", np.float32).reshape(4 * size, 4 * size, 3)[::-1]
    rtgi(file, "render", "--bundle", tmp_path / "bundle", "--device", "cpu", "--samples", 96, "--out", tmp_path / "ours.exr")
    planes, _ = read_exr(tmp_path / "ours.exr")
    ours, theirs = np.stack([planes[name] for name in "RGB"], axis=-1), through_our_filter(drawn, 4)
    keep("atrium in three beside our own", np.concatenate([theirs, np.zeros_like(ours[:, :4]), ours], axis=1))
    assert abs(theirs.mean() / ours.mean() - 1.0) < 0.01
    assert np.abs(theirs - ours).mean() < 0.01 * ours.mean()


def test_the_demo_shows_media(browse, install_three, kit_bundle, tmp_path):
    """The march compiles as WebGL and runs: fog, a box and smoke are before the balls and before the empty sky."""
    image = pytest.importorskip("PIL.Image", reason="reads the page's picture")
    pictures = []
    for name, bundle in (("clear", kit_bundle), ("media", media_bundle())):
        folder = install_three(engines.get("threejs").export(bundle, tmp_path / name).out)
        page = browse(folder, "index.html", screenshot=str(tmp_path / f"{name}.png"))
        assert page["state"] == "ready" and not [text for text in page["messages"] if text.startswith("error")], page
        pictures.append(np.asarray(image.open(tmp_path / f"{name}.png").convert("RGB"), np.int32))
    clear, fogged = pictures
    sky = ~clear.any(axis=2)
    assert sky.mean() > 0.1 and (fogged[sky].max(axis=1) > 8).mean() > 0.5
    assert (np.abs(fogged - clear)[~sky].max(axis=1) > 8).mean() > 0.3
