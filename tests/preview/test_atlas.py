"""Volumes to tiles and back, with no GPU."""

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.preview.atlas import Atlas


@pytest.mark.parametrize("resolution", [(4, 5, 6), (1, 1, 1), (32, 32, 32), (3, 7, 1), (1, 2, 50)])
def test_a_volume_comes_back(resolution):
    volume = np.random.default_rng(0).random((*resolution[::-1], 4)).astype(np.float32)
    atlas = Atlas.of(resolution)
    texels = atlas.pack(volume)
    assert texels.shape == (*atlas.size[::-1], 4)
    assert np.array_equal(atlas.unpack(texels), volume)


def test_cells_stand_where_the_shader_looks():
    atlas = Atlas((4, 3, 5), 2, 3)
    volume = np.arange(60, dtype=np.float32).reshape(5, 3, 4, 1)
    texels = atlas.pack(volume)
    x, y, z = 3, 1, 4
    assert texels[z // 2 * 3 + y, z % 2 * 4 + x, 0] == volume[z, y, x, 0]
    assert not texels[6:, 4:].any()


def test_tiles_are_about_square():
    assert Atlas.of((32, 32, 32)).size == (192, 192)


def test_a_volume_beyond_the_texture_limit_is_refused():
    with pytest.raises(BakeError, match="700 × 700 × 700 cells needs a texture"):
        Atlas.of((700, 700, 700), 16384)
