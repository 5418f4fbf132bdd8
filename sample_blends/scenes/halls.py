"""A hall with more lamps than any of them could be sampled one by one."""

import colorsys
import math

import numpy as np

from . import kit

HALL = (12.0, 7.0, 5.0)  # half length, half width, height [m]


def many_lights():
    """200 lamps of four kinds and all colours among pillars: most of them matter only nearby, so which lamp to sample matters."""
    length, width, height = HALL
    wall = kit.material("Wall", (0.7, 0.68, 0.65))
    floor = kit.material("Floor", (0.3, 0.3, 0.32))
    materials = dict.fromkeys(("-x", "+x", "-y", "+y", "+z"), wall) | {"-z": floor}
    kit.cavities("Hall", (-length - 0.3, -width - 0.3, -0.3), (length + 0.3, width + 0.3, height + 0.3),
                 [((-length, -width, 0.0), (length, width, height))], materials)
    pillar = kit.material("Pillar", (0.55, 0.5, 0.45))
    for i in range(6):
        for j, y in enumerate((-3.4, 0.0, 3.4)):
            x = -10.0 + 4.0 * i
            kit.box(f"Pillar {3 * i + j + 1}", (x - 0.3, y - 0.3, -0.1), (x + 0.3, y + 0.3, height + 0.1), pillar, turn=0.3 * i)
    screen = kit.material("Screen", (0.6, 0.25, 0.2))
    for i in range(5):
        x = -8.0 + 4.0 * i
        y = (-5.2, 4.9)[i % 2]
        kit.box(f"Screen {i + 1}", (x - 1.2, y - 0.06, -0.05), (x + 1.2, y + 0.06, 2.3), screen, turn=0.2 * i)
    hang_lamps()
    kit.probe_volume("Probes", (-length, -width, 0.0), (length, width, height), (10, 6, 4))
    kit.camera((-11.2, -6.2, 3.1), (2.0, 1.2, 1.3), lens=20.0)


def hang_lamps() -> None:
    """Hang 200 lamps on a jittered 20 × 10 lattice between the pillars, the kinds and hues mixed by fixed seeds."""
    rng = np.random.default_rng(3)
    length, width, height = HALL
    for number in range(200):
        column, row = number % 20, number // 20
        x = -length + 0.6 + (2 * length - 1.2) * (column + 0.5) / 20 + rng.uniform(-0.15, 0.15)
        y = -width + 0.4 + (2 * width - 0.8) * (row + 0.5) / 10 + rng.uniform(-0.15, 0.15)
        z = rng.uniform(0.4, 0.92) * height
        # Keep clear of the pillars: no lamp starts out inside one.
        nearest = np.array([(-10.0 + 4.0 * i, p) for i in range(6) for p in (-3.4, 0.0, 3.4)])
        away = np.array((x, y)) - nearest[np.argmin(np.hypot(*(nearest - (x, y)).T))]
        if np.hypot(*away) < 0.6:
            x, y = np.array((x, y)) - away + away / max(np.hypot(*away), 1e-3) * 0.6
        color = colorsys.hsv_to_rgb((number * 0.61803) % 1.0, rng.uniform(0.2, 0.75), 1.0)
        power = float(np.exp(rng.uniform(math.log(2.0), math.log(16.0))))
        place, name = (float(x), float(y), float(z)), f"Lamp {number + 1:03d}"
        kind = number % 5
        if kind < 2:
            kit.lamp(name, "POINT", place, power, color, shadow_soft_size=0.05)
        elif kind == 2:
            target = (place[0] + float(rng.uniform(-1, 1)), place[1] + float(rng.uniform(-1, 1)), 0.0)
            kit.lamp(name, "SPOT", place, 4 * power, color, target, shadow_soft_size=0.03, spot_blend=0.3,
                     spot_size=math.radians(float(rng.uniform(35, 80))))
        elif kind == 3:
            kit.lamp(name, "AREA", place, power, color, (place[0], place[1], 0.0), shape="RECTANGLE", size=0.5, size_y=0.2)
        else:
            kit.lamp(name, "AREA", place, power, color, (0.0, 0.0, 1.0), shape="DISK", size=0.35)
