"""The light atlas exported to Godot: the files, and what a real Godot looks up in them.

RTGI_GODOT is what test_godot.py says it is.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from atlas_bundles import atlas_bundle, light_atlas, relit_atlas_bundle
from real_godot import damaged, drawn, each_renderer, finds, headless, imported, opens, real

from rtgi_addon.effects.atlas.relight import relit_atlas
from rtgi_addon.effects.atlas.sheet import LightAtlas
from rtgi_addon.effects.atlas.unwrapped import Sheet
from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.engines.atlas import engine_atlas
from rtgi_addon.exchange.engines.atlas_transfer import engine_atlas_transfer
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.transfer_conformance import kit_transfer
from rtgi_addon.exchange.exr import read_exr
from rtgi_addon.scene import World
from rtgi_addon.techniques.transfer.lighting import DistantSun, Lighting, sky_of

GODOT = engines.get("godot")
SCRIPT, FOLLOWING = "conformance/atlas.gd", "conformance/atlas_relight.gd"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with a light atlas, as a report."""
    return GODOT.export(atlas_bundle(), tmp_path_factory.mktemp("atlas") / "out")


def test_files(whole):
    assert {"rtgi/atlas.json", "rtgi/atlas.gd", "rtgi/atlas/texels.exr", "rtgi/atlas/texels.exr.import", "conformance/atlas.gd",
            "conformance/atlas.json", "conformance/kit/atlas.json"} <= set(whole.files)
    index = json.loads((whole.out / "rtgi/atlas.json").read_text())
    assert [part["texcoord"] for part in index["parts"]] == [0, 1]
    planes, _ = read_exr(whole.out / "rtgi/atlas/texels.exr")
    assert planes["R"].dtype == np.float16 and planes["R"].size >= 3 * 24 * 32
    assert "#define RTGI_HAS_ATLAS" in (whole.out / "rtgi/irradiance.gdshaderinc").read_text()
    for case in json.loads((whole.out / "conformance/atlas.json").read_text())["cases"]:
        assert len(case["st"]) == 200 and np.max(case["tolerance"]) < 0.02 * np.max(case["irradiance"])


@pytest.mark.parametrize("strength", [1e-3, 1.0, 1e3])
def test_no_texel_is_dimmer_than_halves_that_godot_reads(tmp_path, strength):
    """Godot reads halves below 2^-14 as 0; in a room of 0.002 W/m^2 that was 3 % of the light."""
    bundle = atlas_bundle()
    dim = replace(bundle, atlas=replace(bundle.atlas, coefficients=bundle.atlas.coefficients * np.float32(strength)))
    out = GODOT.export(dim, tmp_path / "out", ExportSettings(part="files")).out
    planes, _ = read_exr(out / "rtgi/atlas/texels.exr")
    stored = np.stack([planes[name] for name in "RGBA"], axis=-1).astype(np.float64)
    stored[np.abs(stored) < np.finfo(np.float16).smallest_normal] = 0.0
    scale = json.loads((out / "rtgi/atlas.json").read_text())["scale"]
    expected = engine_atlas(dim.atlas, Y_UP).slices.astype(np.float64)
    assert np.allclose(np.sort(stored[stored != 0] * scale), np.sort(expected[expected != 0]), rtol=1e-12, atol=0.0)


def test_without_one_none_of_it(kit_bundle, tmp_path):
    report = GODOT.export(kit_bundle, tmp_path / "out")
    assert not [name for name in report.files if "atlas" in name]
    assert "atlas" not in (report.out / "rtgi/irradiance.gdshaderinc").read_text()


def test_axes_turn_directions_and_no_light():
    atlas = light_atlas()
    turned, places = engine_atlas(atlas, Y_UP), np.random.default_rng(1).random((50, 2)) * (32, 24)
    normals = np.random.default_rng(2).normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    assert np.allclose(turned.irradiance(places, Y_UP.directions(normals)), atlas.read(places, normals), rtol=2e-3, atol=2e-3)


def test_what_fits_no_texture_and_maps_out_of_reach_are_told(tmp_path):
    atlas = light_atlas()
    far = replace(atlas.sheet.parts[1], texcoord=2)
    report = GODOT.export(replace(atlas_bundle(), atlas=LightAtlas(Sheet((atlas.sheet.parts[0], far), (24, 32)), *vars_of(atlas))),
                          tmp_path / "far")
    assert any("light atlas of Wall lies in another" in note for note in report.notes)
    wide = LightAtlas(Sheet(atlas.sheet.parts, (1, 2100)), *(np.zeros((1, 2100, *part.shape[2:]), part.dtype)
                                                            for part in vars_of(atlas)))
    with pytest.raises(BakeError, match=r"2100 x 1 texels, 20 x 24 of them for Floor\.001, and Godot takes 2048"):
        GODOT.export(replace(atlas_bundle(), atlas=wide), tmp_path / "wide")


def vars_of(atlas):
    return atlas.coefficients, atlas.irradiance, atlas.known


@pytest.fixture(scope="module")
def project(whole):
    return imported(whole.out)


@real
def test_scripts_agree_without_a_display(project):
    headless(project, SCRIPT, 4)


@real
@each_renderer
def test_shaders_agree(project, options):
    drawn(project, SCRIPT, options, 8)
    opens(project, options)


@real
def test_damage_is_found(project):
    paths = [project / folder / "irradiance.gdshaderinc" for folder in ("rtgi", "conformance/kit")]
    with damaged(paths, "1.0233267 * normal.y, 1.0233267 * normal.z", "1.0233267 * normal.z, 1.0233267 * normal.y"):
        finds(project, SCRIPT, "kit, light atlas, shader")


@pytest.fixture(scope="module")
def relit(tmp_path_factory):
    """An export whose light atlas follows light, as a report."""
    return GODOT.export(relit_atlas_bundle(), tmp_path_factory.mktemp("relit") / "out")


def test_files_of_one_that_follows_light(relit):
    assert {"rtgi/atlas_transfer.json", "rtgi/atlas/transfer.exr", "rtgi/atlas/transfer.exr.import", "rtgi/atlas_relight.gdshader",
            "conformance/atlas_relight.gd", "conformance/shining.gd", "conformance/kit/atlas_transfer.json"} <= set(relit.files)
    assert "uniform bool rtgi_atlas_relit" in (relit.out / "rtgi/irradiance.gdshaderinc").read_text()
    index = json.loads((relit.out / "rtgi/atlas_transfer.json").read_text())
    assert len(index["scales"]) == len(index["lights"]) + index["sky"] + index["sunSide"]**2 == 3 + 9 + 16
    for part in json.loads((relit.out / "conformance/atlas_relight.json").read_text())["sets"]:
        assert len(part["st"]) == 200 and len(part["cases"]) == 12
        assert all(np.max(case["tolerance"]) < 0.03 * np.max(case["irradiance"]) for case in part["cases"])


def test_engines_add_up_what_relight_writes():
    """The sums of columns that kits are made of, against the atlas that `rtgi relight` makes, within what halves hold."""
    bundle, transfer = relit_atlas_bundle(), kit_transfer()
    tables, _ = engine_atlas_transfer(engine_atlas(bundle.atlas, Y_UP), transfer, Y_UP, 2048)
    blue = World(np.random.default_rng(3).random((8, 16, 3)).astype(np.float32))
    for lighting in (Lighting(), Lighting(suns=(DistantSun(np.array([0.6, 0.0, 0.8]), np.ones(3)),)), Lighting(world=blue),
                     Lighting(groups={"Lamps": np.full(3, 0.25)})):
        sky = None if lighting.world is None else sky_of(blue, transfer)
        expected = relit_atlas(bundle.atlas, transfer, lighting).coefficients
        expected = Y_UP.harmonics(expected.reshape(-1, 4, 3)).reshape(expected.shape)
        off = np.abs(tables.coefficients(transfer, lighting, sky) - expected).max() / np.abs(expected).max()
        # Of a sky what harmonics leave takes the way by the suns of the probes, which are of both half spaces here.
        assert off < (2e-3 if sky is None else 0.1), off


@pytest.fixture(scope="module")
def relit_project(relit):
    return imported(relit.out)


@real
@each_renderer
def test_shaders_follow_light(relit_project, options):
    assert drawn(relit_project, FOLLOWING, options, 48).count("PASS relit") == 48
    opens(relit_project, options)


@real
@pytest.mark.parametrize(("file", "old", "new"), [("atlas.gd", "first + 3", "first"),
                                                  ("atlas_relight.gdshader", "texel, 3)", "texel, channel)")],
                         ids=["script", "shader"])
def test_damage_to_what_follows_is_found(relit_project, file, old, new):
    with damaged([relit_project / "rtgi" / file], old, new):
        finds(relit_project, FOLLOWING, "relit kit atlas, a sky with bright spots")
