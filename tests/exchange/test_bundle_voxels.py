"""Lit voxels in bundles: written and read back, damage by name, and what is without any as it was."""

import json

import numpy as np
import pytest
from scene_builders import closed_box
from small_bundles import contents, make_grid, reseal
from tiny_technique import TinyField
from voxel_bundles import lit_voxels

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.bundle import read_bundle, write_bundle
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.voxels import engine_voxels


class Field(TinyField):
    def lit_voxels(self):
        return lit_voxels()


class Nested(TinyField):
    def lit_voxels(self):
        return lit_voxels(2)


def write(out, field=Field):
    return write_bundle(out, field((make_grid(),), False, {}), closed_box(), settings={"order": 1}, seed=3, stats=lambda: {})


@pytest.mark.parametrize(("field", "cascades"), [(Field, 1), (Nested, 2)])
def test_what_is_written_is_read_back(field, cascades, tmp_path):
    path = write(tmp_path / "out", field)
    found, own = read_bundle(path).voxels, lit_voxels(cascades)
    for name in ("rows", "cells", "light", "shapes", "wide"):
        assert np.array_equal(getattr(found.tables, name), getattr(own.tables, name))
    assert found.tables.grids == own.tables.grids and len(own.tables.grids) == cascades
    assert (found.cones, found.step, found.near) == (12, 0.5, 3.0)
    points, normals = np.float32([[0.3, 0.2, 0.1], [-1.2, 0.4, -0.5]]), np.float32([[0, 0, 1], [0.6, 0.8, 0]])
    assert np.array_equal(found.irradiance(points, normals), own.irradiance(points, normals))
    assert found.irradiance(points, normals).max() > 0.1
    assert {"voxels/voxels.json", "voxels/rows.exr", "voxels/cells.exr", "voxels/light.exr"} <= set(contents(path))


def test_a_bundle_without_any_is_as_it_was(tmp_path):
    path = write(tmp_path / "out", TinyField)
    assert read_bundle(path).voxels is None and "voxels" not in json.loads((path / "bake.json").read_text())


def test_nested_grids_that_cannot_be_are_told(tmp_path):
    path = write(tmp_path / "out", Nested)
    whole = (path / "voxels/voxels.json").read_text()
    for number, key, value, said in ((1, "cell", 0.3, "in cells twice as large"),
                                     (1, "corner", [9.0, 9.0, 9.0], "within each other"),
                                     (0, "resolution", [9, 9, 9], "not those of its levels")):
        index = json.loads(whole)
        index["cascades"][number][key] = value
        (path / "voxels/voxels.json").write_text(json.dumps(index))
        reseal(path, "voxels/voxels.json")
        with pytest.raises(BakeError, match=said):
            read_bundle(path)


@pytest.mark.parametrize(("damage", "said"), [
    (lambda index: index.update(cones=9), "9 cones are none that can be traced"),
    (lambda index: index["levels"][1].update(first=3), "levels are not those of its resolution"),
    (lambda index: index["levels"].pop(), "cells, and not"),
    (lambda index: index.update(light="voxels/lamp.exr"), "names voxels/lamp.exr, which has no checksum"),
    (lambda index: index.update(rows_count=7), "cells.exr|rows.exr|light.exr"),
], ids=["cones", "levels", "few", "unknown", "rows"])
def test_damage_is_told_with_the_file(damage, said, tmp_path):
    path = write(tmp_path / "out")
    index = json.loads((path / "voxels/voxels.json").read_text())
    damage(index)
    (path / "voxels/voxels.json").write_text(json.dumps(index))
    reseal(path, "voxels/voxels.json")
    with pytest.raises(BakeError, match=said):
        read_bundle(path)


def test_light_that_halves_do_not_hold_is_no_engines():
    from rtgi_addon import techniques
    from rtgi_addon.progress import Progress
    scene, technique = closed_box(intensity=1e9), techniques.get("cone_tracing")
    field = technique.bake(scene, technique.Settings(resolution=10, light="voxels", bounces=0), np.random.default_rng(1),
                           Progress())
    voxels = field.lit_voxels()
    assert voxels.tables.light.dtype == np.float32
    with pytest.raises(BakeError, match="brighter than half floats hold"):
        engine_voxels(voxels, Y_UP)
