"""The export to Godot as files: textures and their import settings, the include, the light data. What Godot says of them is in
tests/engines/test_godot.py."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.godot import MAX_SCATTERED, MAX_VOLUMES, shader_include
from rtgi_addon.exchange.engines.godot.light_data import LightData, light_data
from rtgi_addon.exchange.engines.volumes import engine_field, export_volumes
from rtgi_addon.exchange.exr import read_exr
from rtgi_addon.techniques.lattice.field import ProbeField

GODOT = engines.get("godot")


@pytest.fixture(scope="module")
def volumes(kit_bundle):
    return export_volumes(engine_field(kit_bundle), Y_UP)


@pytest.fixture(scope="module")
def data(volumes):
    return light_data(volumes)


@pytest.fixture
def export(kit_bundle, tmp_path):
    return GODOT.export(kit_bundle, tmp_path / "out").out


def names_in(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_files(export):
    names = names_in(export)
    assert {"project.godot", "sample.tscn", "sample.gd", "README.md", "rtgi/probes.tscn", "rtgi/probes.gd", "rtgi/volumes.gd",
            "rtgi/irradiance.gdshaderinc", "rtgi/surface.gdshader", "rtgi/light_data.tres", "rtgi/probes.json",
            "conformance/conformance.gd", "conformance/conformance.json", "conformance/kit/probes.json"} <= names
    assert not [name for name in names if name.endswith(".in")]
    for name in names:
        if name.endswith(".exr"):
            assert name + ".import" in names
    assert len((export / "README.md").read_text().strip().splitlines()) <= 14


def test_every_file_that_a_file_names_is_there(export):
    for path in export.rglob("*"):
        if path.suffix in (".gd", ".tscn", ".gdshader", ".gdshaderinc"):
            named = re.findall(r'(?:preload\(|path=|#include )"([^"%]+)"', path.read_text())
            for name in named:
                root = export if name.startswith("res://") else path.parent
                assert (root / name.removeprefix("res://")).is_file(), f"{path.name} names {name}"


def test_without_the_kit_and_with_a_model(kit_bundle, tmp_path):
    model = tmp_path / "Some.glb"
    model.write_bytes(b"glTF and so on")
    report = GODOT.export(kit_bundle, tmp_path / "out", ExportSettings(model=str(model), conformance=False))
    assert (report.out / "model.glb").read_bytes() == b"glTF and so on"
    assert not [name for name in report.files if name.startswith("conformance")]


def test_a_second_export_leaves_what_godot_and_the_user_wrote(kit_bundle, export):
    record, sample = export / "rtgi/Known/probes.exr.import", export / "sample.gd"
    names = (".godot/imported/probes.ctex3d", "rtgi/volumes.gd.uid", "model.glb.import", "model_0.png", ".gitignore", "level.tscn")
    for name in names:
        (export / name).parent.mkdir(parents=True, exist_ok=True)
        (export / name).write_text("mine")
    sample.write_text(sample.read_text() + "# mine\n")
    # As the editor completes it, for a bake of another resolution.
    completed = record.read_text().replace("[remap]\n", '[remap]\n\nuid="uid://b2k"\n')
    completed = completed.replace("compress/mode=0", "compress/mode=1")
    vertical = re.search(r"slices/vertical=\d+", completed)[0]
    record.write_text(completed.replace(vertical, "slices/vertical=3"))
    report = GODOT.export(kit_bundle, export)
    assert report.kept == ("sample.gd",) and sample.read_text().endswith("# mine\n")
    assert all((export / name).read_text() == "mine" for name in names)
    assert record.read_text() == completed
    record.write_text(completed.replace("3d_texture", "texture"))
    assert record.name in GODOT.export(kit_bundle, export).kept[0]


def test_textures_hold_what_the_shader_reads(export, volumes):
    for entry, volume in zip(json.loads((export / "rtgi/probes.json").read_text())["volumes"], volumes, strict=True):
        nx, ny, nz = entry["resolution"]
        planes, _ = read_exr(export / "rtgi" / entry["probes"])
        assert all(plane.dtype == np.float16 for plane in planes.values())
        texels = np.stack([planes[name] for name in "RGBA"], axis=-1).reshape(8, nz, ny, nx, 4).astype(np.float32)
        if "words" in entry:
            words, _ = read_exr(export / "rtgi" / entry["words"])
            stored = np.stack([words[name] for name in "RGBA"], axis=-1)
            assert np.array_equal(stored, volume.words.reshape(-1, *volume.words.shape[2:]))
        assert np.array_equal(texels[0, ..., :3], volume.offset) and np.array_equal(texels[0, ..., 3] > 0, volume.live)
        scale = np.abs(texels[0, ..., 3])
        blocks = texels[1:7].reshape(3, 2, nz, ny, nx, 4)
        for channel in range(3):
            stored = np.concatenate([*blocks[channel], texels[7, ..., [channel]][0][..., None]], axis=-1)
            assert np.allclose(stored * scale[..., None], volume.sh[..., channel], rtol=2**-11, atol=1e-7)
        planes, _ = read_exr(export / "rtgi" / entry["distances"])
        width = entry["tile"] + 2
        for channel, name in enumerate("RG"):
            tiles = planes[name].reshape(nz, ny, width, nx, width).transpose(0, 1, 3, 2, 4)
            assert tiles.dtype == np.float32 and np.array_equal(tiles, volume.moments[..., channel])
        settings = (export / "rtgi" / (entry["probes"] + ".import")).read_text()
        assert 'importer="3d_texture"' in settings and "compress/mode=0" in settings and "mipmaps/generate=false" in settings
        assert f"slices/horizontal=1\nslices/vertical={8 * nz}" in settings


@pytest.mark.parametrize("strength", [1e-4, 1.0, 1e3])
def test_no_probe_is_dimmer_than_halves_that_godot_reads(kit_bundle, tmp_path, strength):
    """Godot reads halves below 2^-14 as 0; in a room of 0.006 W/m^2 that was 1 % of the light."""
    grids = tuple(replace(grid, sh=grid.sh * np.float32(strength)) for grid in kit_bundle.grids)
    dim = replace(kit_bundle, grids=grids)
    out = GODOT.export(dim, tmp_path / "out", ExportSettings(part="files")).out
    for entry, volume in zip(json.loads((out / "rtgi/probes.json").read_text())["volumes"],
                             export_volumes(engine_field(dim), GODOT.axes), strict=True):
        planes, _ = read_exr(out / "rtgi" / entry["probes"])
        nx, ny, nz = entry["resolution"]
        texels = np.stack([planes[name] for name in "RGBA"], axis=-1).reshape(8, nz, ny, nx, 4)
        read = np.where(np.abs(texels) < np.finfo(np.float16).smallest_normal, 0.0, texels.astype(np.float32))
        expected = volume.sh[..., :4, 0]
        off = np.abs(read[1] * np.abs(read[0, ..., 3:]) - expected)
        assert np.all(off <= 2.0**-11 * np.abs(expected) + 2.0**-14 * np.abs(volume.sh).max(axis=(3, 4))[..., None])


@pytest.mark.parametrize(("count", "scattered"), [(1, False), (3, False), (2, True)])
def test_the_include_has_every_volume_and_no_mark(count, scattered):
    text = shader_include(count, scattered=scattered)
    assert text.count("uniform sampler3D rtgi_words_") == count * scattered
    assert "@" not in text and text.count("uniform sampler3D rtgi_probes_") == count
    assert f"rtgi_size_{count - 1}" in text and f"rtgi_size_{count}" not in text and text.count("{") == text.count("}")


def test_too_many_volumes_are_refused(kit_bundle, tmp_path):
    for grids, most in (((MAX_VOLUMES + 1) * kit_bundle.grids[:1], MAX_VOLUMES), (2 * kit_bundle.grids, MAX_SCATTERED)):
        with pytest.raises(BakeError, match=f"{len(grids)} volumes, and a shader in Godot has samplers for {most}"):
            GODOT.export(replace(kit_bundle, grids=grids), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_volume_beyond_3d_textures_is_refused(kit_bundle, tmp_path):
    grid = kit_bundle.grids[0]
    long = replace(grid, **{name: np.repeat(getattr(grid, name), 150, axis=2)
                            for name in ("sh", "validity", "visibility", "offset_world", "standard_error")},
                   volume=replace(grid.volume, resolution=(600, 2, 2)))
    with pytest.raises(BakeError, match="'Known' makes a 3D texture of 6000"):
        GODOT.export(replace(kit_bundle, grids=(long,)), tmp_path / "out")


def test_the_tree_finds_every_tetrahedron_once(data):
    children = data.children
    assert np.all((children < 0) | (children > np.arange(len(children))[:, None]))
    assert sorted((-1 - children[children < 0]).tolist()) == list(range(len(data.tetrahedra)))
    assert np.allclose(np.linalg.norm(data.planes[:, :3], axis=1), 1.0, atol=1e-5)


def test_tetrahedra_fill_the_boxes(volumes, data):
    corners = data.points[data.tetrahedra].astype(np.float64)
    sizes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    boxes = sum(8.0 * abs(np.linalg.det(volume.world_from_local[:3, :3])) for volume in volumes)
    assert sizes.min() > 0 and sizes.sum() == pytest.approx(boxes, rel=1e-4)


def world(volume, lattice):
    return lattice @ volume.offset_from_lattice[:3, :3].T + volume.offset_from_lattice[:3, 3] + volume.centre


def test_a_tap_at_a_probe_is_that_probe(volumes, data):
    for volume in (volume.on_nodes for volume in volumes):
        nz, ny, nx = volume.live.shape
        lattice = np.stack(np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")[::-1], axis=-1).reshape(-1, 3)
        points = world(volume, lattice)
        if volume.name == "Hard":
            inset = volumes[0]
            local = (points - inset.centre) @ np.linalg.inv(inset.world_from_local[:3, :3]).T
            outside = np.abs(local).max(axis=1) > 1.0
            assert 0 < outside.sum() < len(points)
            points, expected = points[outside], volume.sh.reshape(-1, 9, 3)[outside]
        else:
            expected = volume.sh.reshape(-1, 9, 3)
        assert np.abs(data.tap(points) - expected / np.pi).max() < 1e-4 * np.abs(expected).max()


def test_taps_reproduce_what_is_linear_and_reach_the_faces(volumes, data):
    """Barycentric weights are exact for linear functions, between the outermost probes; beyond, the outermost ones go on."""
    volume = volumes[3]
    slope = np.array([0.3, -0.7, 0.5])
    linear = LightData(data.points, np.broadcast_to((data.points @ slope)[:, None, None], data.sh.shape).astype(np.float32),
                       data.tetrahedra, data.planes, data.children, data.bounds)
    lattice = np.random.default_rng(0).uniform(-0.5, np.array(volume.resolution) - 0.5, (200, 3))
    points = world(volume, lattice)
    assert np.abs(linear.tap(points)[:, 0, 0] - points @ slope).max() < 1e-4
    clamped = world(volume, np.clip(lattice, 0, np.array(volume.resolution) - 1))
    outer = np.any(np.abs(points - clamped) > 1e-9, axis=1)
    assert outer.any() and np.abs(data.tap(points) - data.tap(clamped)).max() < 1e-4 * np.abs(data.sh).max()


def test_one_probe_is_enough(kit_bundle):
    grid = kit_bundle.grids[0]
    single = replace(grid, **{name: getattr(grid, name)[:1, :1, :1]
                              for name in ("sh", "validity", "visibility", "offset_world", "standard_error")},
                     volume=replace(grid.volume, resolution=(1, 1, 1)))
    (volume,) = export_volumes(ProbeField((single,)), Y_UP)
    data = light_data((volume,))
    assert np.allclose(data.tap(volume.centre[None] + 0.2), volume.sh.reshape(1, 9, 3) / np.pi, atol=1e-6)


def test_the_resource_brings_numbers_back(data):
    text = data.to_text()

    def numbers(name):
        return [float(word) for word in re.search(rf'"{name}": \w+\(([^)]*)\)', text)[1].split(",")]

    bsp = np.array(numbers("bsp"), np.int64).astype(np.int32).reshape(-1, 6)
    assert np.array_equal(bsp[:, :4].view(np.float32), data.planes) and np.array_equal(bsp[:, 4:], data.children)
    assert np.array_equal(np.float32(numbers("points")).reshape(-1, 3), data.points)
    assert np.array_equal(np.float32(numbers("sh")).reshape(-1, 9, 4)[..., :3], data.sh)
    assert len(numbers("tetrahedra")) == data.tetrahedra.size
