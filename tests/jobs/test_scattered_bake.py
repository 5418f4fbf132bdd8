"""Bakes with scattered probes from the scene to the bundle: what is written is read back, relit, and refused where it is damaged or
where a door does not take it."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from scattered_rooms import across
from small_bundles import edit_manifest, reseal

from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.exchange.exr import read_exr, write_exr
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.jobs.relight import LightChange, relight_bundle
from rtgi_addon.scene import World
from rtgi_addon.techniques.scattered.settings import SCATTERED, ScatterSettings

QUICK = {"error": 0.1, "max_rays": 256, "cache_rays": 16}
PLACED = ScatterSettings(SCATTERED, 0.1)


def room(**changes):
    """A room with a block, and an open ceiling's worth of sky."""
    scene = build.scene([build.cube("room", 2.0, inward=True), build.cube("block", 0.4)], [build.material()],
                        [build.point_light((0.7, 0.8, 1.4), 3.0)],
                        volumes=[build.volume(resolution=(5, 5, 5), half_size=1.95)])
    return replace(scene, **changes)


@pytest.fixture(scope="module")
def baked(tmp_path_factory):
    """A bundle, and the field that it was written from."""
    kept = []
    out = tmp_path_factory.mktemp("scattered") / "bundle"
    summary = bake_scene(room(), "probes", QUICK, out, placement=PLACED, threads=1, keep=kept.append)
    return summary, kept[0]


def test_what_is_written_is_read_back(baked):
    summary, field = baked
    points, normals = across((-1.8, -1.5, -1.9), (1.7, 1.8, 1.5), 200), np.tile(np.float32([0, 0, 1]), (200, 1))
    found = read_bundle(summary.out).field
    assert np.allclose(found.irradiance(points, normals), field.irradiance(points, normals), rtol=1e-5, atol=1e-7)
    assert np.allclose(found.radiance_sh(points), field.radiance_sh(points), rtol=1e-4, atol=1e-6)
    volume, = summary.volumes
    assert volume.scattered and volume.probes == volume.usable < 125 and volume.resolution == (5, 5, 5) and volume.moved == 0
    assert any("scattered probes of" in note for note in summary.notes)


def test_the_same_seed_gives_the_same_bytes(baked, tmp_path):
    again = bake_scene(room(), "probes", QUICK, tmp_path / "again", placement=PLACED, threads=2)
    first = read_bundle(baked[0].out).manifest["sha256"]
    assert read_bundle(again.out).manifest["sha256"] == first and "volume/index.exr" in first


def test_an_index_that_names_what_is_not_there_is_refused(baked, tmp_path):
    import shutil
    shutil.copytree(baked[0].out, tmp_path / "bad")
    file = tmp_path / "bad/volume/index.exr"
    planes, header = read_exr(file, None)
    write_exr(file, {name: np.where(plane > 0, 256.0 * 40000 + 255, plane) for name, plane in planes.items()}, header)
    reseal(tmp_path / "bad", "volume/index.exr")
    with pytest.raises(BakeError, match=r"index\.exr is damaged, it names probes that are not there"):
        read_bundle(tmp_path / "bad")


def test_tiles_of_an_index_that_do_not_fit_are_refused(baked, tmp_path):
    import shutil
    shutil.copytree(baked[0].out, tmp_path / "bad")
    edit_manifest(tmp_path / "bad", lambda manifest: manifest["volumes"][0]["index"].update(resolution=[5, 5, 9000]))
    with pytest.raises(BakeError, match=r"index\.tiles"):
        read_bundle(tmp_path / "bad")


def test_transfer_is_relit_from_scattered_probes(tmp_path):
    scene = room(world=World.constant(0.5))
    out = bake_scene(scene, "transfer", {"rays": 128, "sun_side": 3, "sites": 2, "cache_rays": 16}, tmp_path / "bundle",
                     placement=PLACED, threads=1).out
    relight_bundle(out, tmp_path / "dim", LightChange(groups={}))
    relit = read_bundle(tmp_path / "dim")
    assert relit.grids[0].volume.scattered is not None
    assert np.allclose(relit.grids[0].sh, read_bundle(out).grids[0].sh, atol=1e-6)


def test_fitting_is_refused(tmp_path):
    with pytest.raises(UsageError, match="not fitted to surfaces"):
        bake_scene(room(), "probes", {**QUICK, "fit": True}, tmp_path / "out", placement=PLACED)
