"""Albedo under even light of closures that have no closed form, as `tools/measure_closures.py` prints it from Cycles 5.2."""

import numpy as np

# Diffuse Toon: rows size 0 to 1, columns smoothness 0 to 1.
TOON = np.array([
    [1.0, 0.34, 0.345, 0.354, 0.368], [1.0, 0.559, 0.478, 0.456, 0.562], [1.0, 0.684, 0.585, 0.651, 0.737],
    [1.0, 0.764, 0.757, 0.836, 0.876], [1.0, 0.875, 0.935, 0.954, 0.964], [0.994, 0.994, 0.994, 0.994, 0.994],
])
# Sheen by its distribution: roughness 0 to 1.
SHEEN = {
    "MICROFIBER": np.array([0.0074, 0.0096, 0.0256, 0.0634, 0.1219, 0.1968, 0.2818, 0.3685, 0.4499]),
    "ASHIKHMIN": np.array([0.0074, 0.018, 0.0583, 0.1199, 0.1918, 0.2662, 0.3378, 0.4034, 0.4621]),
}


def toon(size: float, smooth: float) -> float:
    """Albedo of a white diffuse Toon closure, bilinear in the table."""
    row = np.clip(size, 0.0, 1.0) * (len(TOON) - 1)
    low = min(int(row), len(TOON) - 2)
    column = np.clip(smooth, 0.0, 1.0) * (TOON.shape[1] - 1)
    ends = [np.interp(column, np.arange(TOON.shape[1]), TOON[low + step]) for step in (0, 1)]
    return float(ends[0] + (ends[1] - ends[0]) * (row - low))


def sheen(roughness: float, distribution: str = "MICROFIBER") -> float:
    """Albedo of a white Sheen closure."""
    table = SHEEN[distribution]
    return float(np.interp(roughness, np.linspace(0.0, 1.0, len(table)), table))
