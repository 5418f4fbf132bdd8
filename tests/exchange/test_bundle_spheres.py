"""Sphere probes in bundles: written and read back, damage by name, and what is without them as it was."""

import json

import numpy as np
import pytest
from scene_builders import closed_box, transform
from small_bundles import contents, make_grid, reseal
from tiny_technique import TinyField

from rtgi_addon.effects.spheres.maps import SphereMap, SphereProbes
from rtgi_addon.effects.spheres.prefilter import prefiltered
from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.bundle import read_bundle, write_bundle
from rtgi_addon.scene.sphere_probe import SphereProbe


@pytest.fixture(scope="module")
def spheres():
    light = np.random.default_rng(1).random((2, 32, 32, 3)) * 3.0
    levels = prefiltered(light)
    made = [SphereProbe("Hall/é", transform((1, 2, 3), (1, 2, 0.5)), "box", 2.0, 0.3, "sphere", 4.0, 0.1, np.inf),
            SphereProbe("hall_", transform((0, 0, 1)), "sphere", 1.5, 0.2, "box", 1.5, 0.0, 30.0)]
    return SphereProbes([SphereMap(probe, tuple(level[number].astype(np.float16) for level in levels))
                         for number, probe in enumerate(made)], "the light's hash")


def write(out, spheres):
    field = TinyField((make_grid(),), False, {})
    field.spheres = spheres
    return write_bundle(out, field, closed_box(), settings={"order": 1}, seed=3, stats=lambda: {"rays": 1})


def test_what_is_written_is_read_back(spheres, tmp_path):
    path = write(tmp_path / "out", spheres)
    bundle = read_bundle(path)
    assert bundle.spheres is bundle.field.spheres and bundle.spheres.light == "the light's hash"
    for found, item in zip(bundle.spheres.maps, spheres.maps, strict=True):
        for name in ("name", "influence_shape", "influence_distance", "falloff", "parallax_shape", "parallax_distance",
                     "clip_start"):
            assert getattr(found.probe, name) == getattr(item.probe, name)
        assert np.array_equal(found.probe.world_from_local, item.probe.world_from_local)
        assert all(np.array_equal(a, b) for a, b in zip(found.levels, item.levels, strict=True))
    names = set(contents(path))
    assert {"spheres/spheres.json", "spheres/hall.exr", "spheres/Hall-2.exr"} <= names
    assert names - {"bake.json"} == set(json.loads((path / "bake.json").read_text())["sha256"])


def test_a_bundle_without_them_is_as_it_was(tmp_path):
    path = write(tmp_path / "out", None)
    assert read_bundle(path).spheres is None and "spheres" not in json.loads((path / "bake.json").read_text())
    assert not (path / "spheres").exists()


def test_a_volume_called_spheres_keeps_out_of_their_folder(spheres, tmp_path):
    field = TinyField((make_grid("Spheres"),), False, {})
    field.spheres = spheres
    path = write_bundle(tmp_path / "out", field, closed_box(), settings={}, seed=1, stats=dict)
    assert (path / "Spheres-2/sh0.exr").is_file() and read_bundle(path).grids[0].volume.name == "Spheres"


def test_values_that_are_not_finite_are_refused_by_name(spheres, tmp_path):
    levels = (np.full_like(spheres.maps[0].levels[0], np.inf), *spheres.maps[0].levels[1:])
    with pytest.raises(BakeError, match="sphere probe 'hall_': its radiance is negative or not finite"):
        write(tmp_path / "out", SphereProbes([SphereMap(spheres.maps[0].probe, levels)]))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("change", "message"), [
    (lambda index: index.update(resolution=48), "resolution 48 is none of"),
    (lambda index: index["levels"][1].update(alpha=0.5), "levels are not those of maps of 32 texels"),
    (lambda index: index["probes"][0]["influence"].update(shape="cone"), "cone"),
    (lambda index: index["probes"][0]["influence"].update(distance=0.0), "has no volume"),
    (lambda index: index["probes"][0].update(map="../away.exr"), "away.exr"),
    (lambda index: index["probes"][0].update(map="spheres/other.exr"), "other.exr, which has no checksum"),
    (lambda index: index["probes"][1].update(falloff=0.9), "differ in falloff"),
    (lambda index: index.update(probes=[]), "0 probes")])
def test_damage_is_refused_by_name(spheres, tmp_path, change, message):
    path = write(tmp_path / "out", spheres)
    place = path / "spheres/spheres.json"
    index = json.loads(place.read_text())
    change(index)
    place.write_text(json.dumps(index))
    reseal(path, "spheres/spheres.json")
    with pytest.raises(BakeError, match=message):
        read_bundle(path)


def test_a_map_that_was_exchanged_is_noticed(spheres, tmp_path):
    path = write(tmp_path / "out", spheres)
    image = next((path / "spheres").glob("*.exr"))
    image.write_bytes(image.read_bytes()[:-1] + b"\0")
    with pytest.raises(BakeError, match="cut short or damaged"):
        read_bundle(path)
