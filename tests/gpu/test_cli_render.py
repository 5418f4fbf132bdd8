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
    assert report["device"] and set(report["seconds"]) == {"reading", "baking", "drawing", "writing"}
    code, out, err = run("render", "--out", tmp_path / "b.exr", *QUICK, "--bundle", tmp_path / "bake")
    assert code == 0 and "bake (probes)" in out, err
    (baked, about), (shown, _) = read_exr(tmp_path / "a.exr"), read_exr(tmp_path / "b.exr")
    assert list(baked["R"].shape) == report["resolution"][::-1] and about["pass"] == "combined"
    assert all(np.allclose(baked[name], shown[name], atol=1e-6) for name in "RGBA")
    # The red wall is to the left, the green one to the right.
    rows = slice(len(baked["R"]) // 3, None)
    left, right = (np.array([baked[name][rows, side].mean() for name in "RG"]) for side in (slice(0, 4), slice(-4, None)))
    assert left[0] > 2 * left[1] and right[1] > 2 * right[0]


def test_a_picture_by_rays_needs_no_bake_and_says_how_near_it_came(tmp_path):
    words = ("--gather", "rays", "--scale", 0.05, "--picture-error", 0.5, "--set", "ray_traced.diffuse_rays=2")
    code, out, err = run("render", "--out", tmp_path / "a.exr", *words, "--json")
    assert code == 0, err
    report = json.loads(out)
    assert report["technique"] == "rays" and report["effects"] == ["ray_traced"] and report["wanted"] == 0.5
    assert 0.0 < report["error"] <= 0.5 and 4 <= report["samples"] <= 1024
    picture = np.stack([read_exr(tmp_path / "a.exr")[0][name] for name in "RGB"], axis=-1)
    assert np.isfinite(picture).all() and picture.mean() > 0.0
    code, out, err = run("render", "--out", tmp_path / "b.exr", *words, "--samples", 8, "--picture-error", 0.0001)
    assert code == 0 and "0.01 % was asked for: allow more samples" in out, err


@pytest.mark.slow
def test_media_are_in_the_picture_unless_they_are_left_out(needs_gpu, tmp_path):
    """With a GPU and without one."""
    words = ("--technique", "rsm", "--samples", 2, "--scale", 0.1)
    found = {}
    for name, more in {"with": (), "without": ("--without-effect", "media"), "rays": ("--device", "cpu")}.items():
        out = tmp_path / f"{name}.exr"
        code, report, err = run("render", "--out", out, *words, *more, "--json", file=ROOT / "sample_blends/media_box.blend")
        assert code == 0, err
        assert json.loads(report)["effects"] == ([] if name == "without" else ["media"])
        found[name] = np.stack([read_exr(out)[0][channel] for channel in "RGB"], axis=-1)
    assert np.abs(found["rays"] - found["with"]).mean() < 0.05 * found["with"].mean()
    assert np.abs(found["without"] - found["with"]).mean() > 0.08 * found["with"].mean()


def test_effects_are_in_the_picture_and_in_the_report(needs_gpu, tmp_path):
    words = ("--technique", "rsm", "--samples", 2, "--scale", 0.05, "--effect", "mist", "--set", "mist.fade_to=color", "--set",
             "mist.color=0,0,4", "--set", "mist.start=0", "--set", "mist.depth=1")
    code, out, err = run("render", "--out", tmp_path / "misty.exr", *words, "--json")
    assert code == 0 and json.loads(out)["effects"] == ["mist"], err
    misty, about = read_exr(tmp_path / "misty.exr")
    assert about["effects"] == ["mist"]
    # The camera stands further off than a metre: nothing but mist is left.
    assert np.allclose(misty["B"], 4.0) and not misty["R"].any()


def test_rays_draw_the_same_picture_without_a_driver(needs_gpu, tmp_path):
    words = ("--technique", "rsm", "--samples", 4, "--scale", 0.05)
    for device in ("cpu", "gpu"):
        code, out, err = run("render", "--out", tmp_path / f"{device}.exr", *words, "--device", device)
        assert code == 0 and ("on the CPU" in out) == (device == "cpu"), err
    rays, shaders = (read_exr(tmp_path / f"{device}.exr")[0] for device in ("cpu", "gpu"))
    for name in "RGB":
        assert rays[name].mean() == pytest.approx(shaders[name].mean(), rel=0.05)
        assert np.median(np.abs(rays[name].astype(float) - shaders[name])) < 0.05 * shaders[name].mean()


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
    (("--out", "picture.jpg"), 2, "does not end in .exr or .png"),
    (("--out", "README.md/picture.png"), 1, "is no folder"),
    (("--out", "picture.png", "--camera", "Nobody"), 2, "unknown camera 'Nobody': choose one of Camera"),
    (("--out", "picture.png", "--technique", "magic"), 2, "unknown technique 'magic'"),
    (("--out", "picture.png", "--bundle", "nowhere"), 1, "there is no bundle at"),
    (("--out", "picture.png", "--scale", "0"), 2, "--scale"),
    (("--out", "picture.png", "--effect", "magic"), 2, "unknown effect 'magic': choose one of ray_traced, "),
    (("--out", "picture.png", "--set", "mist.start=1"), 2, "is for an effect that is not applied: add --effect mist"),
    (("--out", "picture.png", "--effect", "mist", "--set", "mist.shine=1"), 2, "effect 'mist' has no setting 'shine'"),
    (("--out", "picture.png", "--effect", "mist", "--set", "mist.color=1,2"), 2, "color is '1,2': give 3 numbers"),
    (("--out", "picture.png", "--style", "nice"), 2, "unknown style 'nice': choose one of cel, ink_and_wash"),
    (("--out", "picture.png", "--style", "cel", "--set", "stylized.ramp=red"), 2, "'red' is no stop of a ramp"),
    (("--out", "picture.png", "--effect", "mist", "--pass", "direct"), 2, "--pass direct has no effects"),
    (("--out", "picture.png", "--effect", "media", "--without-effect", "media"), 2, "both name media"),
    (("--out", "picture.png", "--without-effect", "mist"), 2, "invalid choice: 'mist'"),
])
def test_what_is_wrong_is_said_in_one_line(needs_gpu, words, code, said):
    returned, out, err = run("render", *words)
    errors = [line for line in err.splitlines() if line.startswith("rtgi: error: ")]
    assert returned == code and not out and len(errors) == 1 and said in errors[0], err
