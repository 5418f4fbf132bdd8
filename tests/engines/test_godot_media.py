"""Media exported to Godot: the files, and what a real Godot shows of them.

RTGI_GODOT is what test_godot.py says it is.
"""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from media_bundles import box, even_light, fog, media_bundle, smoke
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
from scene_builders import transform as moved

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.media import engine_media
from rtgi_addon.exchange.engines.media_textures import cell_blocks
from rtgi_addon.exchange.engines.volumes import engine_field
from rtgi_addon.exchange.exr import read_exr
from rtgi_addon.scene import DensityGrid, Medium

GODOT = engines.get("godot")
SCRIPT = "conformance/media.gd"
CAMERA = Path(__file__).parent / "godot_media.gd"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with fog, a box and smoke, as a report."""
    return GODOT.export(media_bundle(), tmp_path_factory.mktemp("media") / "out")


def test_files_and_notes(whole):
    assert {"rtgi/media.json", "rtgi/media.gdshaderinc", "rtgi/media.tscn", "rtgi/media/Smoke.exr.import",
            "conformance/media.gd", "conformance/media.json", "conformance/kit/media.json"} <= set(whole.files)
    assert 'path="rtgi/media.tscn"' in (whole.out / "sample.tscn").read_text()
    index = json.loads((whole.out / "rtgi/media.json").read_text())
    planes, _ = read_exr(whole.out / "rtgi" / index["boxes"][0]["cells"])
    assert set(planes) == {"R"} and planes["R"].dtype == np.float16
    planes, _ = read_exr(whole.out / "rtgi" / index["boxes"][1]["cells"])
    assert planes["R"].shape == (3 * 3 * 4, 5)
    notes = " ".join(whole.notes)
    assert "one g for the lamps' light, 0.13" in notes and "in medium Box by 0.667 a metre instead of 0.5, 0.7, 0.8" in notes


def test_what_fog_cannot_hold_is_said(tmp_path):
    notes = " ".join(GODOT.export(media_bundle(fog(0.0, 0.5), smoke(visible_camera=False)), tmp_path / "out").notes)
    assert "the world's is given a density of 0.0001 a metre" in notes and "Smoke is invisible to cameras" in notes


def test_without_media_none_of_it(kit_bundle, tmp_path):
    report = GODOT.export(kit_bundle, tmp_path / "out")
    assert not [name for name in report.files if "media" in name or "fog" in name]
    assert "media" not in (report.out / "sample.tscn").read_text()


def dim_bundle():
    """Fog, smoke and a cloud that grows thin, in light of 0.002 W/m^2."""
    thin = np.exp(-np.linspace(0.0, 14.0, 16, dtype=np.float32))[:, None, None]
    cloud = DensityGrid(moved((0.0, 0.0, 0.0), (1.5, 1.0, 1.0)), thin)
    grids = tuple(replace(grid, sh=grid.sh * np.float32(2e-3)) for grid in media_bundle().grids[1:2])
    cloudy = Medium("Cloud", np.full(3, 5.0), np.full(3, 1.0), grid=cloud)
    return media_bundle(fog(), replace(smoke(), emission=np.full(3, 1e-5)), cloudy, grids=grids)


def test_no_light_and_no_cell_is_below_halves_that_godot_reads(tmp_path):
    """Godot reads halves below 2^-14 as 0."""
    bundle = dim_bundle()
    out = GODOT.export(bundle, tmp_path / "out", ExportSettings(part="files")).out
    index, media = json.loads((out / "rtgi/media.json").read_text()), engine_media(bundle.media, engine_field(bundle), Y_UP)
    for entry, wanted in zip([index["ambient"], *index["boxes"]], [media.ambient, *map(cell_blocks, media.boxes)], strict=True):
        assert np.any((wanted != 0) & (np.abs(wanted) < np.finfo(np.float16).smallest_normal)) or entry.get("name") == "Smoke"
        same_numbers(as_read(out / "rtgi" / entry["cells"]) * entry["scale"], wanted)
    said = (out / "rtgi/media_functions.gdshaderinc").read_text()
    assert f"#define RTGI_AMBIENT_SCALE {index['ambient']['scale']!r}\n" in said


@pytest.fixture(scope="module")
def project(whole):
    return imported(whole.out)


@real
def test_scripts_agree_without_a_display(project):
    headless(project, SCRIPT, 8)


@real
@each_renderer
def test_shaders_agree(project, options):
    drawn(project, SCRIPT, options, 16)


@real
def test_dim_rooms_and_thin_clouds_agree(tmp_path):
    project = imported(GODOT.export(dim_bundle(), tmp_path / "dim").out)
    headless(project, SCRIPT, 8)
    drawn(project, SCRIPT, ("--rendering-driver", "vulkan"), 16)


@real
@pytest.mark.parametrize(("file", "old", "new", "failing"), [
    ("media_functions.gdshaderinc", "moments.x * scattered", "scattered", "kit, media at points, shader"),
    ("media_functions.gdshaderinc", "mix(thick,", "mix(vec3(1.0),", "kit, media along rays, shader"),
    ("media_functions.gdshaderinc", "block * size.z", "0.0 * size.z", "kit, media at points, shader"),
    ("media.gdshaderinc", "rtgi_media_turn * direction", "direction", "kit, media at points, shader, moved")],
    ids=["phase", "slices", "blocks", "turned"])
def test_the_kit_finds_damage(project, file, old, new, failing):
    with damaged([project / "conformance/kit" / file], old, new):
        assert "FAIL bundle" not in finds(project, SCRIPT, f"{failing}:", "vulkan")


def seen(project, distance, radiance, how):
    """What a camera sees of a wall, as Godot's fog (how 1) or the view (2) shows it."""
    code, said = godot(project, "--rendering-driver", "vulkan", "--script", CAMERA, "--", distance, radiance, how)
    drawing(said)
    assert code == 0 and not complaints(said), said
    return np.array([float(value) for value in re.search(r"found (\S+) (\S+) (\S+)", said).groups()])


@real
def test_a_slab_takes_what_it_takes(tmp_path):
    """A wall behind 4 m of an absorbing box, and behind 10 m of fog."""
    dark = even_light(0.0)
    slab = replace(box(matrix=moved((0.0, 5.0, 0.0), (20.0, 2.0, 20.0))), scattering=np.zeros(3), absorption=np.full(3, 0.25))
    project = imported(GODOT.export(media_bundle(slab, grids=dark), tmp_path / "slab", ExportSettings(conformance=False)).out)
    assert seen(project, 10, 1, 2) == pytest.approx(np.full(3, np.exp(-1.0)), rel=0.03)
    assert seen(project, 10, 1, 1) == pytest.approx(np.full(3, np.exp(-1.0)), rel=0.1)
    haze = replace(fog(0.1), scattering=np.zeros(3), absorption=np.full(3, 0.1))
    project = imported(GODOT.export(media_bundle(haze, grids=dark), tmp_path / "fog", ExportSettings(conformance=False)).out)
    assert seen(project, 10, 1, 2) == pytest.approx(np.full(3, np.exp(-1.0)), rel=2e-3)
    assert seen(project, 10, 1, 1) == pytest.approx(np.full(3, np.exp(-1.0)), rel=0.05)


@real
def test_a_medium_that_only_scatters_is_not_seen_in_even_light(tmp_path):
    white = replace(fog(0.1), scattering=np.full(3, 0.1), absorption=np.zeros(3))
    project = imported(GODOT.export(media_bundle(white, grids=even_light(1.0)), tmp_path / "out",
                                    ExportSettings(conformance=False)).out)
    assert seen(project, 10, 1, 2) == pytest.approx(np.ones(3), rel=3e-3)
    assert seen(project, 10, 1, 1) == pytest.approx(np.ones(3), rel=0.05)
