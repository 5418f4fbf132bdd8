"""docs/formats.md: its keys, names and constants are those of the files that are written."""

import json
import re
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
from media_bundles import box, fog, smoke
from small_bundles import make_grid, write

from rtgi_addon.exchange import bundle_media, flipbook, lpv_volume, schema
from rtgi_addon.exchange.engines import axes
from rtgi_addon.exchange.exr import METADATA, read_exr
from rtgi_addon.numerics import sh
from rtgi_addon.scene.scattered import of_grid
from rtgi_addon.storage.parse import Refused

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs/formats.md").read_text(encoding="utf-8")


def keys(first):
    """(required, optional) keys in the table whose head begins with ``first``."""
    table = re.search(rf"^\| {re.escape(first)} \|.*?(?=\n\n)", TEXT, re.MULTILINE | re.DOTALL)[0]
    cells = " ".join(line.split("|")[1] for line in table.splitlines()[2:])
    optional = set(re.findall(r"\*`(\w+)`\*", cells))
    return set(re.findall(r"`(\w+)`", cells)) - optional, optional


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    """A bundle with every file that a technique but `lpv` can write."""
    offset = np.zeros((5, 4, 3, 3), np.float32)
    offset[0, 0, 0, 0] = 0.1
    grid = make_grid(offset_world=offset, standard_error=np.full((5, 4, 3), 0.1, np.float32))
    volume, index = grid.volume, np.zeros((2, 2, 2, 4), np.int32)
    index[..., 0] = 255
    grid = replace(grid, volume=replace(volume, scattered=of_grid(index, volume.world_from_local, offset, grid.validity)))
    return write(tmp_path_factory.mktemp("bundle") / "out", grid, notes=["a note"])


def test_the_tables_have_every_key_that_is_written_and_no_other(bundle):
    manifest = json.loads((bundle / "bake.json").read_text())
    for required, optional, written in ((*keys("key"), manifest), (*keys("key of a volume"), manifest["volumes"][0])):
        assert required <= set(written) and set(written) <= required | optional, set(written) ^ required


@pytest.mark.parametrize("which", ["key", "key of a volume"])
def test_what_may_be_missing_is_what_the_reader_lets_be_missing(bundle, which):
    manifest, (required, optional) = json.loads((bundle / "bake.json").read_text()), keys(which)
    check = schema._MANIFEST if which == "key" else schema._VOLUME
    record = manifest if which == "key" else manifest["volumes"][0]
    for key in (required | optional) & set(record):
        lacking = {name: value for name, value in record.items() if name != key}
        if key in optional:
            check(lacking, "")
        else:
            with pytest.raises(Refused, match=key):
                check(lacking, "")


def test_files_are_named_as_on_the_page(bundle):
    named = set(re.findall(r"OUT/VOLUME/(\w+)\.exr", TEXT)) | {"sh8"}
    written = {path.stem for path in (bundle / "Volume").iterdir()}
    assert {re.sub(r"\d", "", name) for name in written} == {re.sub(r"\d", "", name) for name in named}
    for name in schema.SCHEMA, schema.SH_CONVENTION, schema.SAMPLE_PLACEMENT, lpv_volume.SCHEMA:
        assert f'`"{name}"' in TEXT
    assert f"{flipbook.MAX_SIDE:,} pixels" in TEXT and f"`{METADATA}`" in TEXT


def test_headers_repeat_what_the_page_says(bundle):
    listed = re.search(r"`schema`, `volume`,.*?`visibility_size`\.", TEXT, re.DOTALL)[0]
    listed = set(re.findall(r"`(\w+)`", listed))
    _, coefficient = read_exr(bundle / "Volume/sh1.exr")
    _, tiles = read_exr(bundle / "Volume/visibility.exr")
    assert set(coefficient) | set(tiles) == listed


def test_the_index_of_light_volumes_has_the_keys_of_the_page():
    section = re.search(r"## Light propagation volumes\n(.*?)\n## ", TEXT, re.DOTALL)[1]
    named = set(re.findall(r"`(\w+)`", section))
    assert {"schema", "sh_convention", "cascades", "face_total", "face_ahead", "surface_cells", "dampening"} <= named
    assert {"corner", "cell", "resolution", "tiles", "sh"} <= named


def test_the_index_of_media_has_the_keys_of_the_page(tmp_path):
    bundle_media.write_media(tmp_path, (fog(), box(), smoke(bake="DYNAMIC")))
    index = json.loads((tmp_path / "media/media.json").read_text())
    required, optional = keys("key of a medium")
    section = re.search(r"## Media\n(.*?)\n## ", TEXT, re.DOTALL)[1]
    required -= set(index["media"][0]["phase"])
    for entry in index["media"]:
        assert required <= set(entry) <= required | optional, set(entry) ^ required
        assert set(entry["phase"]) <= set(re.findall(r"`(\w+)`", section))
        assert set(entry.get("grid", {})) <= set(re.findall(r"`(\w+)`", section))
    assert f'`"{bundle_media.SCHEMA}"' in section and set(index) == {"schema", "media"}
    _, header = read_exr(tmp_path / "media/Smoke/emission.exr")
    assert set(header) <= set(re.findall(r"`(\w+)`", section))


def test_a_constant_light_gives_one_in_every_engine():
    stated = re.search(r"k = ([.\d]+), ([.\d]+) × 3, ([.\d]+) × 2, ([.\d]+), ([.\d]+), ([.\d]+)", TEXT).groups()
    k = [float(stated[index]) for index in (0, 1, 1, 1, 2, 2, 3, 4, 5)]
    constants = np.array([.282095, *[.488603] * 3, *[1.092548] * 2, .315392, 1.092548, .546274])
    assert np.allclose(k, constants * sh.cosine_coefficients(2) / pi, atol=1e-6)
    # A constant L = 1 has the one coefficient √4π.
    assert np.sqrt(4 * pi) * k[0] == pytest.approx(1.0, abs=1e-5)


def test_axes_are_those_of_the_code():
    names = {"x": 0, "y": 1, "z": 2}
    stated = re.findall(r"\((−?[xyz]), (−?[xyz]), (−?[xyz])\)", TEXT.split("Axes:")[1])
    for row, known in zip(stated, (axes.Y_UP, axes.UNITY, axes.UNREAL), strict=True):
        expected = np.array([np.eye(3)[names[term[-1]]] * (-1 if "−" in term else 1) for term in row])
        assert np.array_equal(expected, known.engine_from_blender)
    assert axes.UNREAL.scale == 100.0
