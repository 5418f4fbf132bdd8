"""The table of what a GGX layer reflects, against sums over half vectors and what Cycles was measured to reflect."""

import brdf
import numpy as np
import pytest

from rtgi_addon.preview.ggx import SIZE, energy_table


@pytest.mark.parametrize("row", [2, 9, 20, 31])
@pytest.mark.parametrize("column", [4, 15, 30])
def test_energy_is_that_of_another_integration(row, column):
    roughness, cosine = (row + 0.5) / SIZE, (column + 0.5) / SIZE
    one, none = np.ones(3), np.zeros(3)
    a, b = energy_table()[row, column, :2]
    assert a + b == pytest.approx(brdf.ggx_energy(cosine, roughness, one, one)[0], abs=0.01)
    assert b == pytest.approx(brdf.ggx_energy(cosine, roughness, none, one)[0], abs=0.01)


@pytest.mark.parametrize(("roughness", "measured"), [(0.25, 0.990), (0.5, 0.885), (0.75, 0.664)])
def test_a_white_metal_keeps_what_cycles_keeps_of_a_uniform_sky(roughness, measured):
    position = roughness * SIZE - 0.5
    means = energy_table()[:, 0, 2] + energy_table()[:, 0, 3]
    assert np.interp(position, np.arange(SIZE), means) == pytest.approx(measured, abs=0.01)
