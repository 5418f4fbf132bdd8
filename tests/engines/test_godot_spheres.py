"""Sphere probes exported to Godot: the files, and what a real Godot looks up in them.

RTGI_GODOT is what test_godot.py says it is.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from real_godot import as_read, damaged, drawn, each_renderer, finds, headless, imported, opens, real, same_numbers
from sphere_bundles import sphere_bundle

from rtgi_addon.effects.spheres.maps import SphereMap, SphereProbes
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.exr import read_exr

GODOT = engines.get("godot")
SCRIPT = "conformance/spheres.gd"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An export with two sphere probes, as a report."""
    return GODOT.export(sphere_bundle(), tmp_path_factory.mktemp("spheres") / "out")


def test_files(whole):
    assert {"rtgi/spheres.json", "rtgi/spheres.gd", "rtgi/spheres/maps.exr", "rtgi/spheres/maps.exr.import",
            "conformance/spheres.gd", "conformance/spheres.json", "conformance/kit/spheres.json"} <= set(whole.files)
    index = json.loads((whole.out / "rtgi/spheres.json").read_text())
    assert index["names"] == ["Ball", "Hall"] and len(index["table"]) == 16 and index["side"] == 32
    planes, _ = read_exr(whole.out / "rtgi/spheres/maps.exr")
    assert planes["R"].dtype == np.float16 and planes["R"].shape == (2 * 5 * 34, 34)
    assert "rtgi_sphere_table[16]" in (whole.out / "rtgi/irradiance.gdshaderinc").read_text()
    for case in json.loads((whole.out / "conformance/spheres.json").read_text())["cases"]:
        assert len(case["points"]) == 200 and np.ptp([row[3] for row in case["radiance"]]) == 1.0
        assert np.max(case["tolerance"]) < 0.1 * np.max(case["radiance"])


def test_without_them_none_of_it(kit_bundle, tmp_path):
    report = GODOT.export(kit_bundle, tmp_path / "out")
    assert not [name for name in report.files if "sphere" in name]
    assert "sphere" not in (report.out / "rtgi/irradiance.gdshaderinc").read_text()


def dim_bundle(*strengths):
    """Two probes whose light is so many times as strong."""
    bundle = sphere_bundle()
    maps = [SphereMap(item.probe, tuple((level * np.float32(factor)).astype(np.float16) for level in item.levels))
            for item, factor in zip(bundle.spheres.maps, strengths, strict=True)]
    return replace(bundle, spheres=SphereProbes(maps))


def test_no_map_is_dimmer_than_halves_that_godot_reads(tmp_path):
    """Godot reads halves below 2^-14 as 0."""
    bundle = dim_bundle(1e-3, 1e3)
    out = GODOT.export(bundle, tmp_path / "out", ExportSettings(part="files")).out
    maps, table = as_read(out / "rtgi/spheres/maps.exr"), json.loads((out / "rtgi/spheres.json").read_text())["table"]
    for number, stack in enumerate(bundle.spheres.stacks):
        assert number or np.any((stack != 0) & (stack < np.finfo(np.float16).smallest_normal))
        # Levels below each other, of one probe below the other.
        same_numbers(maps[number * len(stack):(number + 1) * len(stack)] * table[8 * number + 7][2], stack)


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
def test_dim_rooms_agree(tmp_path):
    project = imported(GODOT.export(dim_bundle(1e-3, 2e-3), tmp_path / "dim").out)
    headless(project, SCRIPT, 4)
    drawn(project, SCRIPT, ("--rendering-driver", "vulkan"), 8)


@real
@pytest.mark.parametrize(("old", "new", "failing"), [
    ("alpha * reach / max(away, 1e-12)", "alpha", "kit, sphere probes, shader"),
    ("left -= share", "left -= 0.0", "kit, sphere probes, shader"),
    ("mat3(rtgi_spheres_local_from_world) * direction_world", "direction_world", "kit, sphere probes, shader, moved")],
    ids=["width", "weights", "turned"])
def test_damage_is_found(project, old, new, failing):
    with damaged([project / folder / "irradiance.gdshaderinc" for folder in ("rtgi", "conformance/kit")], old, new):
        finds(project, SCRIPT, failing)
