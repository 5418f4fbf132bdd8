"""Transfer in exports: tables that give what `rtgi relight` gives, and the files around them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from atlas_bundles import relit_atlas_bundle
from transfer_bundles import transfer_bundle, uneven_transfer

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.engines.atlas import engine_atlas
from rtgi_addon.exchange.engines.atlas_transfer import conformance_json, engine_atlas_transfer
from rtgi_addon.exchange.engines.axes import UNREAL, Y_UP
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.exchange.engines.transfer import NUMBERS, engine_transfer, tables_of, weights
from rtgi_addon.exchange.engines.transfer_conformance import kit_transfer, lightings
from rtgi_addon.exchange.engines.volumes import export_volumes, held_field
from rtgi_addon.exchange.exr import read_exr
from rtgi_addon.numerics import sh
from rtgi_addon.scene import World
from rtgi_addon.techniques.lattice.lookup import LookupSettings
from rtgi_addon.techniques.transfer.lighting import Lighting
from rtgi_addon.techniques.transfer.relight import relit


@pytest.mark.parametrize("axes", [Y_UP, UNREAL], ids=["Y up", "left-handed"])
def test_columns_times_light_are_what_relight_says(axes):
    """Of every lighting, before deringing, along the engine's axes."""
    transfer = kit_transfer()
    tables = tables_of(transfer, axes)
    seen_from = axes.directions(transfer.sun_directions)
    for name, lighting, sky in lightings(transfer):
        light = weights(transfer, lighting, sky)
        light[len(transfer.lights):tables.first_sun] = axes.harmonics(light[len(transfer.lights):tables.first_sun])
        spikes = np.zeros((len(seen_from), 3)) if sky is None else sky.suns
        field = held_field(relit(transfer, lighting, sky)).with_lookup(LookupSettings("linear"))
        for volume, table in zip(export_volumes(field, axes), tables.tables, strict=True):
            columns = table[..., :27].astype(np.float64).reshape(*table.shape[:2], 9, 3) * tables.scales[:, None, None, None]
            found = np.einsum("cpkx,cx->pkx", columns, light)
            seen = (table[..., 27] * tables.scales[:, None].astype(np.float64))[tables.first_sun:]
            found += np.einsum("sp,sk,sx->pkx", seen, sh.evaluate(seen_from, 2), spikes)
            expected = volume.sh.reshape(-1, 9, 3)
            assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max(), name


def as_imported(table):
    """``table`` as Godot's importer leaves it, which reads halves below their full digits as 0."""
    return np.where(np.abs(table) < np.finfo(np.float16).smallest_normal, np.float16(0.0), table)


def test_probes_far_from_a_lamp_keep_their_digits():
    transfer = uneven_transfer()
    tables, night = tables_of(transfer, Y_UP), Lighting(World.constant(0.0), ())
    column = [kind for _, kind in transfer.lights].index("group")
    field = held_field(relit(transfer, night)).with_lookup(LookupSettings("linear"))
    for volume, table in zip(export_volumes(field, Y_UP), tables.tables, strict=True):
        expected = volume.sh.reshape(len(table[column]), -1)
        found = as_imported(table)[column, :, :27] * tables.scales[column]
        # Half a digit, and what turning axes costs in float32.
        assert np.all(np.abs(found - expected) <= 2.0**-11 * np.abs(expected) + 1e-6 * np.abs(expected).max(axis=1, keepdims=True))


def test_texels_far_from_a_lamp_are_within_the_kits_tolerance():
    bundle, transfer = relit_atlas_bundle(uneven=True), uneven_transfer()
    atlas = engine_atlas(bundle.atlas, Y_UP)
    tables, _ = engine_atlas_transfer(atlas, transfer, Y_UP, 2048)
    found = conformance_json(atlas, replace(tables, tables=as_imported(tables.tables)), transfer, Y_UP)["sets"][1]
    expected = conformance_json(atlas, tables, transfer, Y_UP)["sets"][1]
    for got, case in zip(found["cases"], expected["cases"], strict=True):
        off = np.abs(np.subtract(got["irradiance"], case["irradiance"]))
        assert np.max(off / case["tolerance"]) < 0.01, case["name"]


def test_fewer_bands_are_zero_and_more_are_left_out():
    transfer = kit_transfer()
    low = replace(transfer, order=1, grids=tuple(replace(
        grid, bounce=grid.bounce[..., :4, :], sky=grid.sky[..., :4, :], suns=grid.suns[..., :4, :], lights=grid.lights[..., :4, :],
        local=grid.local[..., :4, :]) for grid in transfer.grids))
    table = tables_of(low, Y_UP).tables[0]
    assert not table[..., 12:27].any() and table[..., :12].any() and table.shape[2] == NUMBERS


def test_without_transfer_there_is_none(tmp_path):
    bundle = replace(transfer_bundle(), manifest={"scene": "kit", "includes_direct": False})
    assert engine_transfer(bundle, Y_UP) is None
    for name in ("godot", "threejs"):
        report = engines.get(name).export(bundle, tmp_path / name)
        assert not [file for file in report.files if "relight" in file.lower() or "transfer" in file or "day" in file]
        assert not [note for note in report.notes if "relight" in note]


@pytest.mark.parametrize(("name", "files"), [
    ("godot", {"rtgi/transfer.json", "rtgi/relight.gd", "rtgi/relit.gd", "rtgi/relight.tscn", "rtgi/relight.gdshader", "day.tscn",
               "conformance/relight.gd", "conformance/relight.json", "conformance/kit/transfer.json"}),
    ("threejs", {"rtgi/transfer.json", "rtgi/transfer.bin", "rtgi/RTGIRelight.js", "rtgi/RTGIRelight.d.ts", "rtgi/relit.js",
                 "day.js", "relight.mjs", "conformance/relight.json", "conformance/kit_transfer.bin"})])
def test_files_and_notes(tmp_path, name, files):
    report = engines.get(name).export(transfer_bundle(), tmp_path / "out")
    assert files <= set(report.files)
    assert any("relighting takes 0.5 MiB of tables, 2.5 kB a probe" in note for note in report.notes)
    readme = (report.out / "README.md").read_text()
    assert "Deutsch: Tag und Nacht" in readme and "{number}" not in readme
    expected = json.loads((report.out / "conformance/relight.json").read_text())
    assert [part["volumes"] for part in expected["sets"]] == ["kit", "bundle"]
    assert all(len(part["cases"]) == 12 and len(part["points"]) == 200 for part in expected["sets"])
    part = engines.get(name).export(transfer_bundle(), tmp_path / "part", ExportSettings(part="files")).files
    assert not [file for file in part if not file.startswith("rtgi/")]


def test_lamp_sites_are_said_to_be_left_out():
    from rtgi_addon.exchange.engines.transfer import notes_on_transfer
    tables = tables_of(kit_transfer(), Y_UP)
    assert len(notes_on_transfer(tables)) == 1
    sited = replace(tables, source=replace(tables.source, sites=np.zeros((5, 3))))
    assert "the responses at 5 lamp sites are left out" in notes_on_transfer(sited)[1]


def test_godots_tables_lie_as_its_shader_reads_them(tmp_path):
    out = engines.get("godot").export(transfer_bundle(), tmp_path / "out").out
    index = json.loads((out / "rtgi/transfer.json").read_text())
    tables = tables_of(kit_transfer(), Y_UP)
    volumes = json.loads((out / "rtgi/probes.json").read_text())["volumes"]
    for entry, volume, table in zip(index["volumes"], volumes, tables.tables, strict=True):
        nx, ny, nz = volume["resolution"]
        planes, _ = read_exr(out / "rtgi" / entry["table"])
        sheet = np.stack([planes[letter] for letter in "RGBA"], axis=-1)
        columns = sheet.shape[1] // (7 * nx)
        for column, probe in ((0, 0), (17, 3), (len(table) - 1, nx * ny * nz - 1)):
            x, y, z = probe % nx, probe // nx % ny, probe // (nx * ny)
            slice_, row = column // entry["down"] * nz + z, column % entry["down"] * ny + y
            left, top = slice_ % columns * 7 * nx + 7 * x, slice_ // columns * entry["down"] * ny + row
            assert np.array_equal(sheet[top, left:left + 7].ravel(), table[column, probe])
    assert "uniform sampler2D rtgi_probes_0" in (out / "rtgi/irradiance.gdshaderinc").read_text()


def test_the_kit_is_of_the_kits_probes():
    assert [grid.grid.volume.name for grid in kit_transfer().grids] == [grid.volume.name for grid in kit_field().grids()]
