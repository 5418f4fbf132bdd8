"""`rtgi render` through the module's door, as a process without a display."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")

from rtgi_addon.exchange.exr import read_exr  # noqa: E402

pytestmark = pytest.mark.skipif(not bpy.app.module, reason="the module's door needs the module: this is a real Blender")
ROOT = Path(__file__).resolve().parents[2]
CORNELL = ROOT / "sample_blends/cornell_box.blend"
QUICK = ("--rays", 16, "--samples", 2, "--scale", 0.05)


def run(*words, file=CORNELL):
    """Exit code, stdout, stderr."""
    ran = subprocess.run([sys.executable, "-m", "rtgi_addon", str(file), *map(str, words)], cwd=ROOT, capture_output=True,
                         text=True, timeout=300, check=False)
    return ran.returncode, ran.stdout, ran.stderr


@pytest.fixture(scope="module")
def needs_gpu(gpu_device):
    """Skips where no process here could open a GPU."""


def test_a_picture_of_a_bundle_is_that_of_its_bake(needs_gpu, tmp_path):
    assert run("bake", "--out", tmp_path / "bake", "--rays", 16)[0] == 0
    code, out, err = run("render", "--out", tmp_path / "a.exr", *QUICK, "--json")
    assert code == 0, err
    report = json.loads(out)
    assert report["camera"] == "Camera" and report["technique"] == "probes" and report["samples"] == 2
    assert report["gpu"] and set(report["seconds"]) == {"reading", "baking", "drawing", "writing"}
    code, out, err = run("render", "--out", tmp_path / "b.exr", *QUICK, "--bundle", tmp_path / "bake")
    assert code == 0 and "bake (probes)" in out, err
    (baked, about), (shown, _) = read_exr(tmp_path / "a.exr"), read_exr(tmp_path / "b.exr")
    assert list(baked["R"].shape) == report["resolution"][::-1] and about["pass"] == "combined"
    assert all(np.allclose(baked[name], shown[name], atol=1e-6) for name in "RGBA")
    # The red wall is to the left, the green one to the right.
    rows = slice(len(baked["R"]) // 3, None)
    left, right = (np.array([baked[name][rows, side].mean() for name in "RG"]) for side in (slice(0, 4), slice(-4, None)))
    assert left[0] > 2 * left[1] and right[1] > 2 * right[0]


@pytest.mark.slow
def test_a_png_has_the_scenes_view_transform(needs_gpu, tmp_path):
    """The sample's is Standard: sRGB."""
    import bpy
    words = ("--samples", 2, "--scale", 0.05, "--pass", "albedo", "--technique", "lpv", "--set", "steps=2")
    for name in ("a.png", "a.exr"):
        code, _, err = run("render", "--out", tmp_path / name, *words)
        assert code == 0, err
    image = bpy.data.images.load(str(tmp_path / "a.png"))
    shown = np.flipud(np.array(image.pixels).reshape(image.size[1], image.size[0], -1))
    bpy.data.images.remove(image)
    stored, _ = read_exr(tmp_path / "a.exr")
    linear, white = stored["G"], (stored["G"] > 0.72) & (stored["A"] == 1.0)
    assert white.any() and np.all(shown[white][:, 3] == 1.0)
    np.testing.assert_allclose(shown[white][:, 1], 1.055 * linear[white] ** (1 / 2.4) - 0.055, atol=2 / 255)


@pytest.mark.parametrize(("words", "code", "said"), [
    (("--out", "picture.jpg"), 2, "neither an .exr nor a .png"),
    (("--out", "missing/picture.png"), 1, "does not exist"),
    (("--out", "picture.png", "--camera", "Nobody"), 1, "unknown camera 'Nobody': choose one of Camera"),
    (("--out", "picture.png", "--technique", "magic"), 1, "unknown technique 'magic'"),
    (("--out", "picture.png", "--bundle", "nowhere"), 1, "there is no bundle at"),
    (("--out", "picture.png", "--scale", "0"), 2, "--scale"),
])
def test_what_is_wrong_is_said_in_one_line(needs_gpu, words, code, said):
    returned, out, err = run("render", *words)
    errors = [line for line in err.splitlines() if line.startswith("rtgi: error: ")]
    assert returned == code and not out and len(errors) == 1 and said in errors[0], err
