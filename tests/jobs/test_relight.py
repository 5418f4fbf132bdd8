"""`rtgi relight`: bundles with transfer under other light, from the files alone."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scene_builders as build
from atlas_scenes import in_atlas
from small_bundles import reseal

from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.exchange.exr import write_exr
from rtgi_addon.exchange.sky_image import read_sky
from rtgi_addon.exchange.transfer_files import read_transfer
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.relight import LightChange, read_frames, relight_bundle
from rtgi_addon.scene import PointLight, SunLight, World

SETTINGS = {"rays": 256, "sun_side": 4, "sites": 3}


def yard(world=(0.4, 0.6, 1.0), sun=2.0, lamp=1.0):
    """A block on a floor under sky, sun and a lamp in the group Street."""
    lights = (SunLight("Sun", np.array([0.0, 0.6, -0.8]), np.full(3, sun, np.float32)),
              PointLight("Lamp", np.array([0.9, 0.9, 0.8]), np.full(3, lamp, np.float32), light_group="Street"))
    scene = build.scene([build.plane("floor", 2.0), build.cube("block", 0.3)], lights=lights,
                        volumes=(build.volume(resolution=(2, 3, 2), half_size=0.9, center=(0, 0, 1.0)),))
    return replace(scene, world=World.constant(world))


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    """A bundle with transfer of the yard."""
    return bake_scene(yard(), "transfer", SETTINGS, tmp_path_factory.mktemp("relight") / "bundle", threads=1).out


def sh_of(path):
    return read_bundle(path).grids[0].sh


def test_without_a_change_the_light_is_the_bakes(bundle, tmp_path):
    relight_bundle(bundle, tmp_path / "out", LightChange())
    assert np.allclose(sh_of(tmp_path / "out"), sh_of(bundle), atol=1e-6)
    manifest = read_bundle(tmp_path / "out").manifest
    assert "transfer" not in manifest and manifest["lamps"] == read_bundle(bundle).manifest["lamps"]
    assert manifest["notes"][0] == "relit from bundle: the light it was baked with"


def test_what_is_written_is_read_back_to_half_floats(bundle):
    content = read_bundle(bundle)
    fresh = bake_scene(yard(), "transfer", {**SETTINGS, "half": False}, bundle.parent / "whole", threads=1).out
    half, whole = content.transfer_field.transfer, read_bundle(fresh).transfer_field.transfer
    assert half.half and not whole.half and half.lights == whole.lights
    assert half.lights == (("world", "world"), ("suns", "suns"), ("Street", "group")) and half.sources == whole.sources
    for name in ("sky", "bounce", "suns", "seen", "lights", "local"):
        a, b = getattr(half.grids[0], name), getattr(whole.grids[0], name)
        assert a.shape == b.shape and np.abs(a - b).max() <= 1e-3 * np.abs(b).max()
    assert np.array_equal(half.grids[0].lights, whole.grids[0].lights)
    index = json.loads((bundle / "transfer/transfer.json").read_text())
    assert 0 < index["half_error"] < 1e-3 and index["bytes_per_probe"] == 2 * (4 * 81 + 16 * 28 + 81) + 4 * 81


def test_suns_by_vectors_are_what_the_table_is_nearest_to(bundle, tmp_path):
    from rtgi_addon.blender.cli.info import BundleReport
    path = bake_scene(yard(), "transfer", {**SETTINGS, "sun_vectors": 5}, tmp_path / "few", threads=1).out
    content, index = read_bundle(path), json.loads((path / "transfer/transfer.json").read_text())
    few, full = content.transfer_field.transfer, read_bundle(bundle).transfer_field.transfer
    assert few.sun_vectors == 5 and index["vectors"]["count"] == 5
    assert index["bytes_per_probe"] == 2 * (4 * 81 + 5 * 27 + 16 + 81) + 4 * 81
    suns, table = few.grids[0].suns, full.grids[0].suns
    assert suns.shape == table.shape and np.linalg.matrix_rank(suns.reshape(-1, 16), tol=1e-4 * np.abs(suns).max()) == 5
    # No other five vectors are nearer (Eckart and Young, 1936).
    least = np.linalg.svd(table.reshape(-1, 16).astype(np.float64), compute_uv=False)
    assert index["vectors"]["error"] == pytest.approx(np.sqrt((least[5:] ** 2).sum() / (least**2).sum()), rel=0.01)
    assert np.linalg.norm(suns - table) / np.linalg.norm(table) == pytest.approx(index["vectors"]["error"], rel=0.02)
    for name in ("sky", "bounce", "seen", "lights", "local"):
        assert np.array_equal(getattr(few.grids[0], name), getattr(full.grids[0], name))
    assert "16 directions of the sun by 5 vectors (off by" in BundleReport(content).to_text()
    relight_bundle(path, tmp_path / "out", LightChange(suns=((30.0, 50.0, 3.0),)))
    relight_bundle(bundle, tmp_path / "table", LightChange(suns=((30.0, 50.0, 3.0),)))
    assert not np.array_equal(sh_of(tmp_path / "out"), sh_of(tmp_path / "table"))
    assert np.linalg.norm(sh_of(tmp_path / "out") - sh_of(tmp_path / "table")) < 0.1 * np.linalg.norm(sh_of(tmp_path / "table"))
    index["vectors"]["count"] = 6
    (path / "transfer/transfer.json").write_text(json.dumps(index))
    with pytest.raises(BakeError, match="vectors_sheet is not that of the vectors"):
        read_transfer(path, content.grids)


def test_another_world_is_a_fresh_bake(bundle, tmp_path):
    relight_bundle(bundle, tmp_path / "out", LightChange(world=(1.0, 0.5, 0.25), groups={"Street": (0.5, 0.5, 0.5)}))
    fresh = bake_scene(yard(world=(1.0, 0.5, 0.25), lamp=0.5), "transfer", SETTINGS, tmp_path / "fresh", threads=1).out
    # The bake's own world has the noise of 256 rays, of which the matrices are freed.
    assert np.linalg.norm(sh_of(tmp_path / "out") - sh_of(fresh)) < 1e-2 * np.linalg.norm(sh_of(fresh))


def test_the_first_sun_replaces_the_files(bundle, tmp_path):
    relight_bundle(bundle, tmp_path / "out", LightChange(suns=((0.0, 90.0, 2.0), (90.0, 30.0, 0.0, 1.0, 1.0, 1.0))))
    fresh = replace(yard(), lights=(SunLight("Sun", np.array([0.0, 0.0, -1.0]), np.full(3, 2.0, np.float32)), yard().lights[1]))
    fresh = bake_scene(fresh, "transfer", SETTINGS, tmp_path / "fresh", threads=1).out
    # Of four directions a side none is the zenith.
    assert np.linalg.norm(sh_of(tmp_path / "out") - sh_of(fresh)) < 0.15 * np.linalg.norm(sh_of(fresh))


def test_a_turned_sky_is_the_image_turned(bundle, tmp_path):
    # u = ½ − azimuth/2π: a quarter turn to the left is a quarter of the columns to the left.
    pixels = np.random.default_rng(0).uniform(0.0, 1.0, (16, 32, 3)).astype(np.float32)
    for name, image in (("sky", pixels), ("turned", np.roll(pixels, -8, axis=1))):
        write_exr(tmp_path / f"{name}.exr", {letter: image[..., c] for c, letter in enumerate("RGB")}, {})
    relight_bundle(bundle, tmp_path / "one", LightChange(world=str(tmp_path / "sky.exr"), sky_turn=90.0))
    relight_bundle(bundle, tmp_path / "other", LightChange(world=str(tmp_path / "turned.exr")))
    relight_bundle(bundle, tmp_path / "third", LightChange(world=str(tmp_path / "sky.exr")))
    assert np.allclose(sh_of(tmp_path / "one"), sh_of(tmp_path / "other"), atol=1e-4)
    assert not np.allclose(sh_of(tmp_path / "one"), sh_of(tmp_path / "third"), atol=1e-3)


def test_a_series_writes_a_bundle_a_frame(bundle, tmp_path):
    frames = tmp_path / "frames.json"
    frames.write_text(json.dumps({"schema": "rtgi-frames/1", "frames": [
        {"name": "noon", "suns": [[0, 80, 3]]}, {"name": "night", "suns": [], "world": [0, 0, 0], "groups": {"Street": 2.0}}]}))
    report = relight_bundle(bundle, tmp_path / "day", LightChange(groups={"Street": (0.0, 0.0, 0.0)}), frames)
    assert [path.name for path in report.out] == ["noon", "night"] and report.probes == 12
    night = sh_of(tmp_path / "day/night")
    street = read_bundle(bundle).transfer_field.transfer.grids[0].lights[..., 2]
    assert np.allclose(night, 2.0 * np.moveaxis(street, 0, -1), atol=1e-5)


@pytest.mark.parametrize(("document", "words"), [
    ({"schema": "rtgi-frames/1", "frames": []}, "it has no frames"),
    ({"schema": "rtgi-frames/1", "frames": [{"name": "a", "suns": [[1, 2]]}]}, "has 2 numbers"),
    ({"schema": "rtgi-frames/1", "frames": [{"name": "a", "colour": 1}]}, "'colour' is unknown"),
    ({"schema": "rtgi-frames/1", "frames": [{"name": "a", "groups": {"b": -1}}]}, "not from 0"),
])
def test_a_wrong_series_is_refused(tmp_path, document, words):
    path = tmp_path / "frames.json"
    path.write_text(json.dumps(document))
    with pytest.raises(BakeError, match=words):
        read_frames(path)


def test_what_cannot_be_relit_is_refused(bundle, tmp_path):
    with pytest.raises(UsageError, match="there is no light group 'Lamps': choose one of Street"):
        relight_bundle(bundle, tmp_path / "out", LightChange(groups={"Lamps": (1.0, 1.0, 1.0)}))
    relight_bundle(bundle, tmp_path / "once", LightChange())
    with pytest.raises(BakeError, match="it was relit: give the bundle that it was relit from"):
        relight_bundle(tmp_path / "once", tmp_path / "out", LightChange())
    assert not (tmp_path / "out").exists()


def test_a_sun_below_the_horizon_is_said(bundle, tmp_path):
    report = relight_bundle(bundle, tmp_path / "out", LightChange(suns=((0.0, -10.0, 3.0),)))
    assert report.notes == ("out: a sun below the horizon gives nothing (bake with --set sun_below=true for that)",)


def test_damaged_transfer_is_named(bundle, tmp_path):
    import shutil
    copy = tmp_path / "copy"
    shutil.copytree(bundle, copy)
    file = next((copy / "transfer").rglob("suns3.exr"))
    file.write_bytes(file.read_bytes()[:-7])
    with pytest.raises(BakeError, match=r"suns3\.exr is cut short or damaged"):
        read_bundle(copy)


def test_radiance_images_are_read(tmp_path):
    pixels = np.array([[[128, 64, 32, 129], [0, 0, 0, 0], [255, 255, 255, 128], [1, 2, 3, 130]],
                       [[200, 10, 10, 127]] * 4], np.uint8)
    path = tmp_path / "sky.hdr"
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + pixels.tobytes())
    read = read_sky(path)[::-1]
    assert np.allclose(read[0, 0], [128.5 / 128, 64.5 / 128, 32.5 / 128]) and not read[0, 1].any()
    wide = np.zeros((8, 16, 4), np.uint8)
    wide[..., 0], wide[..., 3] = np.arange(16), 136
    rows = b"".join(b"\2\2\0\x10" + b"".join((b"\x10" + component.tobytes()) if c == 0 else bytes([128 + 16, component[0]])
                                             for c, component in enumerate(row.T)) for row in wide)
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n" + rows)
    assert np.allclose(read_sky(path)[..., 0], np.arange(16) + 0.5)
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(BakeError, match="cut short"):
        read_sky(path)
    with pytest.raises(UsageError, match="no image of a sky"):
        read_sky(tmp_path / "sky.png")


def test_the_command_runs_without_blender_and_embree(bundle, tmp_path):
    code = ("import sys\nfor name in ('bpy', 'embreex', 'mathutils'): sys.modules[name] = None\n"
            "from rtgi_addon.blender.cli import main_module\n"
            f"sys.exit(main_module(['relight', {str(bundle)!r}, '--out', {str(tmp_path / 'out')!r}, '--sun', '-30,45,3', '--lamp', "
            "'-0.5,0,1,60', '--group', 'Street=1,0,0', '--sky-turn', '-10']))")
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "ms each time" in done.stdout and read_bundle(tmp_path / "out").grids[0].sh.any()


def test_media_stay_and_are_said_not_to_be_followed(tmp_path):
    from rtgi_addon.scene import Medium
    scene = replace(yard(), media=(Medium("Haze", np.full(3, 0.05)),))
    report = bake_scene(scene, "transfer", {**SETTINGS, "rays": 64, "sites": 0}, tmp_path / "bundle", threads=1)
    assert any("transfer leaves medium 'Haze' out" in str(entry) for entry in read_bundle(report.out).manifest["not_followed"])
    relight_bundle(tmp_path / "bundle", tmp_path / "out", LightChange(world=(1.0, 1.0, 1.0)))
    assert [medium.name for medium in read_bundle(tmp_path / "out").media] == ["Haze"]


@pytest.fixture(scope="module")
def with_atlas(tmp_path_factory):
    """A bundle with transfer of the yard whose floor is in the light atlas, which follows suns from 16 directions."""
    uv = [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]]
    return bake_scene(in_atlas(yard(), 0, uv), "transfer", {**SETTINGS, "rays": 64}, tmp_path_factory.mktemp("atlas") / "bundle",
                      atlas=AtlasSettings(density=2.0, rays=64, suns=4), threads=1).out


def test_the_atlas_is_relit_along(with_atlas, tmp_path):
    before = read_bundle(with_atlas).atlas
    assert before.transfer.lights.shape[-1] == 3 and before.transfer.suns.shape[-1] == 16
    report = relight_bundle(with_atlas, tmp_path / "same", LightChange())
    same = read_bundle(tmp_path / "same").atlas
    assert np.allclose(same.coefficients, before.coefficients, atol=1e-5) and same.transfer is None and report.notes == ()
    assert json.loads((with_atlas / "atlas/atlas.json").read_text())["transfer"]["half_error"] < 1e-3
    relight_bundle(with_atlas, tmp_path / "off", LightChange(groups={"Street": (0.0, 0.0, 0.0)}))
    lamp = before.coefficients - read_bundle(tmp_path / "off").atlas.coefficients
    assert np.allclose(np.moveaxis(before.transfer.lights[..., :4, 2], 0, -1), lamp, atol=1e-5)
    assert lamp[before.known][:, 0].mean() > 0
    report = relight_bundle(with_atlas, tmp_path / "noon", LightChange(world=(0.8, 1.2, 2.0), suns=((0.0, 60.0, 3.0),),
                                                                       lamps=((0.0, 0.0, 1.0, 5.0),)))
    noon = read_bundle(tmp_path / "noon").atlas
    assert noon.irradiance[noon.known].mean() > 1.5 * before.irradiance[before.known].mean()
    assert "does not follow new lamps" in report.notes[0]


def test_an_atlas_without_transfer_is_left_out_and_told(with_atlas, tmp_path):
    assert read_bundle(with_atlas).manifest["atlas"]
    index = with_atlas / "atlas/atlas.json"
    content = json.loads(index.read_text())
    plain = tmp_path / "plain"
    shutil.copytree(with_atlas, plain)
    del content["transfer"]
    (plain / "atlas/atlas.json").write_text(json.dumps(content))
    reseal(plain, "atlas/atlas.json")
    report = relight_bundle(plain, tmp_path / "out", LightChange())
    assert read_bundle(tmp_path / "out").atlas is None and "left out" in report.notes[0]
