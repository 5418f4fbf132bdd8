"""Flipbooks: every probe at the pixel that docs/formats.md says, and back."""

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange import flipbook
from rtgi_addon.exchange.flipbook import Tiles


@pytest.fixture
def volume():
    """Each probe holds its own x, y, z; 5 × 3 × 7 probes."""
    z, y, x = np.meshgrid(np.arange(7), np.arange(3), np.arange(5), indexing="ij")
    return np.stack([x, y, z], axis=-1).astype(np.float32)


@pytest.mark.parametrize("tiles", [Tiles(1, 7), Tiles(2, 4), Tiles(3, 3), Tiles(7, 1)])
def test_every_probe_lands_on_its_pixel(volume, tiles):
    sheet = flipbook.to_sheet(volume, tiles)
    assert sheet.shape == (tiles.rows * 3, tiles.columns * 5, 3)
    for z in range(7):
        left, top = z % tiles.columns * 5, z // tiles.columns * 3
        for y in range(3):
            for x in range(5):
                assert tuple(sheet[top + y, left + x]) == (x, y, z)
    assert np.array_equal(flipbook.from_sheet(sheet, (5, 3, 7), tiles), volume)


def test_tiles_without_a_slice_are_black(volume):
    sheet = flipbook.to_sheet(volume + 1, Tiles(2, 4))
    assert not sheet[3 * 3:, 5:].any()


def test_octahedral_maps_lie_row_by_row_in_their_probe(volume):
    maps = np.random.default_rng(0).random((7, 3, 5, 4, 4, 2), dtype=np.float32)
    tiles = Tiles(2, 4)
    sheet = flipbook.octahedral_to_sheet(maps, tiles)
    z, y, x = 5, 1, 3
    top, left = (z // 2 * 3 + y) * 4, (z % 2 * 5 + x) * 4
    assert np.array_equal(sheet[top:top + 4, left:left + 4], maps[z, y, x])
    assert np.array_equal(flipbook.octahedral_from_sheet(sheet, (5, 3, 7), 4, tiles), maps)


@pytest.mark.parametrize(("resolution", "cell", "expected"), [
    ((4, 4, 4), 1, Tiles(1, 4)),
    ((1, 1, 1), 1, Tiles(1, 1)),
    ((128, 128, 128), 1, Tiles(1, 128)),
    ((128, 128, 129), 1, Tiles(2, 65)),
    ((32, 32, 32), 16, Tiles(1, 32)),
    ((32, 32, 33), 16, Tiles(2, 17)),
])
def test_one_column_until_a_side_would_pass_the_limit(resolution, cell, expected):
    tiles = flipbook.layout(resolution, cell)
    assert tiles == expected
    assert tiles.columns * tiles.rows >= resolution[2]
    assert max(tiles.columns * resolution[0], tiles.rows * resolution[1]) * cell <= flipbook.MAX_SIDE


@pytest.mark.parametrize("resolution", [(20000, 1, 1), (1, 20000, 1), (4096, 4096, 64)])
def test_a_volume_that_fits_no_image_is_refused(resolution):
    with pytest.raises(BakeError, match="does not fit an image"):
        flipbook.layout(resolution)


def test_a_sheet_of_another_size_is_refused(volume):
    with pytest.raises(ValueError, match="do not hold"):
        flipbook.from_sheet(flipbook.to_sheet(volume, Tiles(1, 7)), (5, 3, 8), Tiles(1, 7))
