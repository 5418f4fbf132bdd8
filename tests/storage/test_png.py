"""Whether a picture that somebody else wrote is whole."""

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.storage.png import require_whole_png, write_png


@pytest.fixture
def picture(tmp_path):
    return write_png(tmp_path / "a.png", np.random.default_rng(0).integers(0, 255, (9, 7, 3), np.uint8))


def test_a_whole_one_is(picture):
    require_whole_png(picture, (9, 7))
    with pytest.raises(BakeError, match="did not get to the disk whole"):
        require_whole_png(picture, (7, 9))


def test_one_that_was_cut_or_changed_anywhere_is_not(picture):
    data = picture.read_bytes()
    cuts = [data[:length] for length in range(0, len(data), 3)]
    flips = [data[:place] + bytes([data[place] ^ 16]) + data[place + 1:] for place in range(len(data))]
    for damaged in (*cuts, *flips, data[:50] + bytes(len(data) - 50), data + b"\0"):
        picture.write_bytes(damaged)
        with pytest.raises(BakeError, match="did not get to the disk whole"):
            require_whole_png(picture, (9, 7))
