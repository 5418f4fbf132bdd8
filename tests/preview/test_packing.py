"""Lists in rows of texels, and visibility in bits."""

import numpy as np
import pytest

from rtgi_addon.preview.packing import FOLD_WIDTH, LIGHTS_PER_TEXEL, fold, unfold, visibility_bits


@pytest.mark.parametrize(("n", "channels"), [(1, 3), (5000, 4), (10000, 7), (4097, 12)])
def test_a_folded_list_keeps_items_whole(n, channels):
    rows = np.random.default_rng(0).random((n, channels)).astype(np.float32)
    texels = fold(rows)
    parts = -(-channels // 4)
    per_row = texels.shape[1] // parts
    assert texels.shape[1] <= FOLD_WIDTH and texels.shape[1] % parts == 0
    i = n - 1
    item = texels[i // per_row, i % per_row * parts:(i % per_row + 1) * parts].reshape(-1)
    assert np.array_equal(item[:channels], rows[i])


def test_a_list_of_points_comes_back():
    rows = np.random.default_rng(0).random((9000, 3)).astype(np.float32)
    assert np.array_equal(unfold(fold(rows), 9000, 3), rows)


@pytest.mark.parametrize("lights", [1, 23, 24, 96, 97, 1000])
def test_a_bit_stands_for_each_light(lights):
    visibility = np.random.default_rng(0).random((7, lights)) < 0.5
    words = visibility_bits(visibility)
    assert words.shape == (7, -(-lights // LIGHTS_PER_TEXEL) * 4) and words.dtype == np.float32
    light = np.arange(lights)
    read = words.astype(np.uint32)[:, light // 24] >> (light % 24).astype(np.uint32) & 1
    assert np.array_equal(read.astype(bool), visibility)
