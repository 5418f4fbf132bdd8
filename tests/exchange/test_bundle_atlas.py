"""The light atlas in bundles: written and read back, damage by name, and what is without one as it was."""

import json

import numpy as np
import pytest
from atlas_bundles import light_atlas
from scene_builders import closed_box
from small_bundles import contents, make_grid, reseal
from tiny_technique import TinyField

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.bundle import read_bundle, write_bundle


def write(out, atlas):
    field = TinyField((make_grid(),), False, {})
    field.atlas = atlas
    return write_bundle(out, field, closed_box(), settings={"order": 1}, seed=3, stats=lambda: {"rays": 1})


def test_what_is_written_is_read_back(tmp_path):
    atlas = light_atlas()
    path = write(tmp_path / "out", atlas)
    bundle = read_bundle(path)
    found = bundle.atlas
    assert found is bundle.field.atlas and found.sheet.size == atlas.sheet.size
    for name in ("coefficients", "irradiance", "known"):
        assert np.array_equal(getattr(found, name), getattr(atlas, name))
    for part, own in zip(found.sheet.parts, atlas.sheet.parts, strict=True):
        assert (part.name, part.uv_map, part.texcoord, part.scale) == (own.name, own.uv_map, own.texcoord, own.scale)
        assert np.array_equal(part.offset, own.offset)
    names = set(contents(path))
    assert {"atlas/atlas.json", "atlas/sh3.exr", "atlas/known.exr", "atlas/lightmap.png"} <= names
    assert names - {"bake.json"} == set(json.loads((path / "bake.json").read_text())["sha256"])


def test_a_bundle_without_one_is_as_it_was(tmp_path):
    path = write(tmp_path / "out", None)
    assert read_bundle(path).atlas is None and "atlas" not in json.loads((path / "bake.json").read_text())


@pytest.mark.parametrize(("damage", "said"), [
    (lambda index: index.update(width=16), "part 'Floor.001' is not within 16 × 24 texels"),
    (lambda index: index["sh"].pop(), "sh"),
    (lambda index: index.update(known="atlas/sh0.exr"), "is named twice"),
    (lambda index: index["parts"][0].update(scale=float("inf")), "atlas.json"),
    (lambda index: index["parts"].clear(), "it has no parts"),
], ids=["outside", "few", "twice", "infinite", "none"])
def test_damage_is_told_with_the_file(damage, said, tmp_path):
    path = write(tmp_path / "out", light_atlas())
    index = json.loads((path / "atlas/atlas.json").read_text())
    damage(index)
    (path / "atlas/atlas.json").write_text(json.dumps(index))
    reseal(path, "atlas/atlas.json")
    with pytest.raises(BakeError, match=said):
        read_bundle(path)


def test_light_that_is_not_finite_is_not_written(tmp_path):
    atlas = light_atlas()
    atlas.coefficients[3, 3, 0, 0] = np.nan
    with pytest.raises(BakeError, match="light atlas holds values that are not finite"):
        write(tmp_path / "out", atlas)
