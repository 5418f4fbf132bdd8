"""The pages of an export to three.js, in Chromium on a software GPU: the conformance page, and the demo beside our own picture."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[2]


def rtgi(sample, *words):
    """Run a subcommand on a sample."""
    file = ROOT / "sample_blends" / f"{sample}.blend"
    ran = subprocess.run([sys.executable, "-m", "rtgi_addon", file, *map(str, words)], cwd=ROOT, capture_output=True, text=True,
                         timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_the_gpu_agrees(browse, install_three, export, release):
    page = browse(install_three(export, release), "conformance.html")
    assert page["state"] == "passed" and page["shown"].count("pass  ") == 14, page
    assert not [message for message in page["messages"] if message.startswith("error")], page


@pytest.mark.parametrize(("webgpu", "device"), [(True, "on WebGPU"), (False, "on WebGL 2 in place of WebGPU")])
def test_the_gpu_agrees_through_nodes(browse, install_three, export, webgpu, device):
    page = browse(install_three(export), "conformance.html?webgpu", webgpu=webgpu)
    assert page["state"] == "passed" and page["shown"].count("pass  ") == 12, page
    if webgpu and device not in page["shown"]:
        pytest.skip("this Chromium has no WebGPU in software; WebGL 2 took its place")
    assert device in page["shown"], page
    assert not [message for message in page["messages"] if message.startswith("error")], page


def test_the_gpu_finds_damage(browse, install_three, export):
    """The page fails where the shader does: without the Chebyshev bound here."""
    shader = install_three(export) / "rtgi" / "shader.js"
    text = shader.read_text()
    assert "behind > 0.0 ? bound * bound * bound : 1.0" in text
    shader.write_text(text.replace("behind > 0.0 ? bound * bound * bound : 1.0", "1.0"))
    page = browse(export, "conformance.html")
    assert page["state"] == "failed" and "FAIL  visibility" in page["shown"] and "pass  known content" in page["shown"], page


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
    # The page has no background.
    surface = (ours.min(axis=-1) > 0.0) & (theirs.min(axis=-1) > 0.0)
    assert surface.mean() > 0.8
    difference, brightness = np.abs(theirs - ours)[surface], ours[surface].mean()
    assert difference.mean() < mean * brightness
    assert np.median(difference) < 1e-3 * brightness
    assert abs(theirs[surface].mean() / brightness - 1.0) < 0.01
