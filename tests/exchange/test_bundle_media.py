"""Media in bundles: written and read back, the insides of meshes on grids, damage by name."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scene_builders import closed_box, cube, sphere
from scene_builders import transform as moved
from small_bundles import contents, edit_manifest, make_grid, reseal
from tiny_technique import TinyField

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import bundle_media
from rtgi_addon.exchange.bundle import read_bundle, write_bundle
from rtgi_addon.exchange.media_grids import on_a_grid
from rtgi_addon.scene import ClosedMesh, DensityGrid, Medium, Phase
from rtgi_addon.transport.media.table import Filling, MediaTable

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def inside_of(mesh, matrix):
    return ClosedMesh(mesh.vertices_local, mesh.triangles, matrix)


@pytest.fixture(scope="module")
def media():
    rng = np.random.default_rng(1)
    smoke = DensityGrid(moved((1, 2, 3), (1, 2, 0.5), TURN), rng.random((2, 3, 4), np.float32),
                        emission=rng.random((2, 3, 4, 3), np.float32))
    return (Medium("fog", np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.1, 0.0]), phase=Phase("DRAINE", 0.4, 0.7)),
            Medium("fog", np.ones(3), bounds=inside_of(cube(), moved((0, 1, 0), (1.0, 0.5, 2.0), TURN)), visible_shadow=False),
            Medium("Smoke/é", np.ones(3), np.ones(3), np.array([1.0, 0.5, 0.0]), Phase("RAYLEIGH"), grid=smoke, bake="DYNAMIC"))


def write(out, media):
    return write_bundle(out, TinyField((make_grid(),), False, {}), replace(closed_box(), media=media), settings={"order": 1},
                        seed=3, stats=lambda: {"rays": np.int64(9), "seconds": {"bake": 1.0}})


def test_what_is_written_is_read_back(media, tmp_path):
    path = write(tmp_path / "out", media)
    found = read_bundle(path).media
    for held, medium in zip(found, media, strict=True):
        for kind in ("name", "phase", "visible_camera", "visible_diffuse", "visible_shadow", "bake"):
            assert getattr(held, kind) == getattr(medium, kind)
        for kind in ("scattering", "absorption", "emission"):
            assert np.array_equal(getattr(held, kind), getattr(medium, kind))
    assert found[0].grid is None and found[1].grid.resolution == (1, 1, 1) and found[2].grid.absorption is None
    for kind in ("world_from_local", "density", "emission"):
        assert np.array_equal(getattr(found[2].grid, kind), getattr(media[2].grid, kind))
    names = set(contents(path))
    assert {"media/media.json", "media/fog-2/density.exr", "media/Smoke/density.exr", "media/Smoke/emission.exr"} <= names
    assert names - {"bake.json"} == set(json.loads((path / "bake.json").read_text())["sha256"])


def test_without_media_no_byte_is_another(tmp_path):
    path = write(tmp_path / "out", ())
    assert read_bundle(path).media == () and "media" not in json.loads((path / "bake.json").read_text())
    assert not (path / "media").exists()


def test_a_volume_called_media_keeps_out_of_their_folder(media, tmp_path):
    field = TinyField((make_grid("Media"),), False, {})
    path = write_bundle(tmp_path / "out", field, replace(closed_box(), media=media), settings={}, seed=1, stats=dict)
    assert (path / "Media-2/sh0.exr").is_file() and read_bundle(path).grids[0].volume.name == "Media"


def test_a_box_is_exact_whatever_way_it_lies(media):
    rng = np.random.default_rng(2)
    origins, directions = rng.normal(size=(200, 3)) * 3, rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ours, theirs = (MediaTable([medium]).transmittance(origins, directions) for medium in (on_a_grid(media[1]), media[1]))
    assert np.abs(ours - theirs).max() < 1e-6 and np.ptp(theirs) > 0.5


def test_a_dented_box_is_none():
    mesh = cube()
    vertices = mesh.vertices_local.copy()
    vertices[np.all(vertices > 0, axis=1)] *= 0.2
    held = on_a_grid(Medium("dent", np.ones(3), bounds=ClosedMesh(vertices, mesh.triangles, np.eye(4))))
    assert held.grid.resolution == (64, 64, 64) and held.grid.density[-1, -1, -1] == 0 and held.grid.density[0, 0, 0] == 1


def test_a_sphere_on_a_grid_takes_what_a_sphere_takes():
    """The mean transmittance over the disc of a sphere of optical radius τ: (1 − (1 + 2τ)e^−2τ)/(2τ²)."""
    mesh = sphere(subdivisions=4)
    held = on_a_grid(Medium("ball", np.ones(3), emission=np.ones(3), bounds=inside_of(mesh, np.eye(4))))
    assert held.grid.resolution == (64, 64, 64)
    volume = 4.0 / 3.0 * np.pi
    assert held.grid.density.mean() * 8.0 == pytest.approx(volume, rel=5e-3)
    assert np.array_equal(held.grid.emission[..., 1], held.grid.density)
    rng = np.random.default_rng(3)
    radius, turn = np.sqrt(rng.random(4000)), 2 * np.pi * rng.random(4000)
    origins = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(4000, -2.0)], axis=1)
    along = np.broadcast_to([0.0, 0.0, 1.0], origins.shape)
    passed = MediaTable([held]).transmittance(origins, along)[:, 0]
    exact = np.exp(-2.0 * np.sqrt(1.0 - radius**2))
    assert passed.mean() == pytest.approx(0.296997, abs=0.012) and np.abs(passed - exact).mean() < 0.01


def test_a_grid_within_a_mesh_ends_where_the_mesh_does():
    smoke = DensityGrid(moved(scale=(2, 2, 2)), np.full((32, 32, 32), 3.0, np.float32))
    held = on_a_grid(Medium("smoke", np.ones(3), bounds=inside_of(cube(), np.eye(4)), grid=smoke))
    points = np.array([[0, 0, 0], [0.9, 0.9, 0.9], [1.2, 0, 0], [-1.5, 1.5, 0.0]])
    assert np.allclose(Filling(held).coefficients(points).scattering[:, 0], [3, 3, 0, 0], atol=1e-6)


def renamed(path):
    index = json.loads((path / bundle_media.INDEX).read_text())
    index["media"][2]["grid"]["density"] = "media/fog-2/density.exr"
    (path / bundle_media.INDEX).write_text(json.dumps(index))
    reseal(path, bundle_media.INDEX)


def negative(path):
    text = (path / bundle_media.INDEX).read_text()
    (path / bundle_media.INDEX).write_text(text.replace("0.3", "-0.3"))
    reseal(path, bundle_media.INDEX)


def unknown(path):
    edit_manifest(path, lambda manifest: (manifest["sha256"].pop("media/Smoke/density.exr"),
                                          manifest["bytes"].pop("media/Smoke/density.exr")))


@pytest.mark.parametrize(("damage", "said"), [
    (lambda path: (path / "media/Smoke/density.exr").unlink(), "density.exr"),
    (lambda path: (path / "media/media.json").write_text("{}"), "media.json"),
    (renamed, "named twice"), (negative, "-0.3, not from 0"), (unknown, "has no checksum")],
    ids=["gone", "changed", "another medium's", "negative", "unknown"])
def test_damage_is_found_by_name(media, tmp_path, damage, said):
    path = write(tmp_path / "out", media)
    damage(path)
    with pytest.raises(BakeError, match=said):
        read_bundle(path)


@pytest.mark.parametrize("value", [np.nan, -1.0])
def test_a_density_that_is_none_writes_nothing(tmp_path, value):
    density = np.full((2, 2, 2), value, np.float32)
    with pytest.raises(BakeError, match="'smoke': its density is negative or not finite"):
        write(tmp_path / "out", (Medium("smoke", np.ones(3), grid=DensityGrid(np.eye(4), density)),))
    assert not (tmp_path / "out").exists()
