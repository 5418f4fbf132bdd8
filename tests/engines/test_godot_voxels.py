"""Lit voxels exported to Godot: the files, and what cones find in a real one.

RTGI_GODOT is what test_godot.py says it is.
"""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from real_godot import (
    as_read,
    complaints,
    damaged,
    drawing,
    drawn,
    each_renderer,
    finds,
    godot,
    headless,
    imported,
    real,
    same_numbers,
)
from voxel_bundles import lit_voxels, voxel_bundle

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.voxels import engine_voxels
from rtgi_addon.exchange.exr import read_exr

GODOT = engines.get("godot")
SCRIPT = "conformance/voxels.gd"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with voxels, as a report."""
    return GODOT.export(voxel_bundle(), tmp_path_factory.mktemp("voxels") / "out")


def test_files(whole):
    assert {"rtgi/voxels.json", "rtgi/voxels.gd", "rtgi/voxel_cones.gd", "rtgi/voxels.gdshaderinc",
            "rtgi/voxel_surface.gdshader", "rtgi/voxels/rows.exr",
            "rtgi/voxels/cells.exr", "rtgi/voxels/light.exr.import", "conformance/voxels.gd", "conformance/voxels.json",
            "conformance/kit/voxels.json"} <= set(whole.files)
    planes, _ = read_exr(whole.out / "rtgi/voxels/rows.exr")
    assert planes["R"].dtype == np.float32 and int(planes["R"].max()) == len(lit_voxels().tables.cells) - 1
    for case in json.loads((whole.out / "conformance/voxels.json").read_text())["cases"]:
        assert len(case["points"]) == 200 and np.max(case["tolerance"]) < 0.01 * np.max(case["irradiance"])
    assert any("12 cones a pixel" in note for note in whole.notes)


def test_without_any_none_of_it(kit_bundle, tmp_path):
    report = GODOT.export(kit_bundle, tmp_path / "out", None)
    assert not [name for name in report.files if "voxel" in name]


def test_axes_turn_places_and_no_light():
    turned, rng = engine_voxels(lit_voxels(), Y_UP), np.random.default_rng(1)
    points, normals = rng.uniform(-0.8, 0.8, (20, 3)), rng.normal(size=(20, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    assert np.allclose(turned.irradiance(Y_UP.vectors(points), Y_UP.directions(normals)), lit_voxels().irradiance(points, normals),
                       rtol=1e-3, atol=1e-3)


def test_more_voxels_than_textures_hold_are_refused():
    class Many:
        def __len__(self):
            return 1 << 25
    source = lit_voxels()
    with pytest.raises(BakeError, match="more than textures of engines take: bake it with a lower resolution"):
        engine_voxels(replace(source, tables=replace(source.tables, cells=Many())), Y_UP)


def dim_bundle():
    """Voxels in light of 0.002 W/m^2, of which some let nearly all of it through."""
    source = lit_voxels()
    cells, light = source.tables.cells.copy(), source.tables.light.astype(np.float32)
    cells[1::7, :3] *= np.float16(1e-5)
    return replace(voxel_bundle(), voxels=replace(source, sky=1e-3 * source.sky, tables=replace(
        source.tables, cells=cells, light=(1e-3 * light).astype(np.float16))))


def test_no_list_has_less_than_halves_that_godot_reads(tmp_path):
    """Godot reads halves below 2^-14 as 0."""
    bundle = dim_bundle()
    out = GODOT.export(bundle, tmp_path / "out", ExportSettings(part="files")).out
    said = (out / "rtgi/voxels.gdshaderinc").read_text()
    for name, wanted in (("cells", bundle.voxels.tables.cells), ("light", bundle.voxels.tables.light)):
        assert np.any((wanted != 0) & (np.abs(wanted) < np.finfo(np.float16).smallest_normal))
        scale = float(re.search(rf"#define RTGI_VOXEL_{name.upper()}_OVER (\S+)\n", said)[1])
        same_numbers(as_read(out / f"rtgi/voxels/{name}.exr") * scale, wanted)


@pytest.fixture(scope="module")
def project(whole):
    return imported(whole.out)


@real
def test_scripts_agree(project):
    headless(project, SCRIPT, 4)


@real
@each_renderer
def test_shaders_agree(project, options):
    drawn(project, SCRIPT, options, 8)


@real
def test_dim_rooms_agree(tmp_path):
    drawn(imported(GODOT.export(dim_bundle(), tmp_path / "dim").out), SCRIPT, ("--rendering-driver", "vulkan"), 8)


@real
def test_a_surface_is_lit(project):
    shutil.copy(Path(__file__).with_name("godot_voxels.gd"), project / "surface_check.gd")
    code, said = godot(project, "--rendering-driver", "opengl3", "--script", "surface_check.gd")
    drawing(said)
    assert code == 0 and not complaints(said) and float(re.search(r"mean ([0-9.e-]+)", said)[1]) > 0.02, said


@real
def test_damage_is_found(project):
    with damaged([project / "rtgi/voxel_cones.gd"], "adds = level > grid", "adds = false"):
        finds(project, SCRIPT, "kit, voxels, script")
    with damaged([project / "rtgi/voxels.gdshaderinc"], "RTGI_CONE_TIGHT * met.share", "0.5 * met.share"):
        finds(project, SCRIPT, "bundle, voxels, shader")
