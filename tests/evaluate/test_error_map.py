"""Error maps: the right pixels, the right sign, the right colours."""

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.evaluate.error_map import COLOURS, FULL_SCALE, ErrorMap
from rtgi_addon.transport.context import LightContext


class Constant:
    """Irradiance of one value everywhere."""

    def __init__(self, value):
        self.value = value

    def irradiance(self, points, normals):
        return np.full((len(points), 3), self.value, np.float32)


@pytest.fixture(scope="module")
def furnace_map():
    """Irradiance 2π on every wall."""
    return ErrorMap(LightContext(build.cube_furnace(albedo=0.5, emission=1.0, resolution=(2, 2, 2)), 1), (48, 36))


def test_a_right_field_is_white_and_a_wrong_one_is_not(furnace_map):
    assert len(furnace_map.seen) > 100
    right, dark, bright = (furnace_map.relative_error(Constant(2 * np.pi * share)) for share in (1.0, 0.7, 1.3))
    assert np.abs(right).mean() < 0.05
    assert dark.mean() == pytest.approx(-0.3, abs=0.03) and bright.mean() == pytest.approx(0.3, abs=0.03)
    seen = [furnace_map.colours(error).reshape(-1, 3)[furnace_map.seen].mean(axis=0) for error in (dark, right, bright)]
    assert seen[0][2] > seen[0][0] + 0.2 and seen[2][0] > seen[2][2] + 0.2
    assert np.ptp(seen[1]) < 0.1 and seen[1].min() > 0.7


def test_the_scale_ends_at_its_ends(furnace_map):
    for error, colour in ((-2 * FULL_SCALE, COLOURS[0]), (2 * FULL_SCALE, COLOURS[-1]), (0.0, COLOURS[5])):
        picture = furnace_map.colours(np.full(len(furnace_map.seen), error)).reshape(-1, 3)[furnace_map.seen]
        assert np.all(picture <= colour + 1e-6) and np.all(picture >= 0.85 * colour)


def test_a_picture_is_written_enlarged(furnace_map, tmp_path):
    path = furnace_map.write(tmp_path / "map.png", furnace_map.reference_picture())
    header = path.read_bytes()[16:24]
    assert (int.from_bytes(header[:4]), int.from_bytes(header[4:])) == (
        furnace_map.width * furnace_map.scale, furnace_map.height * furnace_map.scale)
