"""Many arrays in one file."""

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.storage.array_file import ARRAY_INDEX, read_arrays, write_arrays
from rtgi_addon.storage.parse import Refused
from rtgi_addon.storage.workplace import workplace

ARRAYS = {"a": np.arange(6, dtype=np.float32).reshape(2, 3), "none": np.zeros((0, 3)), "one": np.array(7, np.int64),
          "flags": np.array([True, False]), "big": np.arange(3, dtype=">f8"), "across": np.arange(12.0).reshape(3, 4).T}


@pytest.fixture
def written(tmp_path):
    """(file, index) of ARRAYS."""
    with workplace(tmp_path / "out", "test") as place:
        index = write_arrays(place.new / "x.bin", ARRAYS)
        place.put_folder({})
    return tmp_path / "out/x.bin", index


def test_arrays_come_back(written):
    file, index = written
    ARRAY_INDEX(index, "arrays")
    found = read_arrays(file, index, "")
    assert list(found) == list(ARRAYS)
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].shape == array.shape and found[name].dtype == array.dtype.newbyteorder("<")
        assert not found[name].size or not found[name].flags.writeable or found[name].base is None


def test_a_file_that_is_not_what_the_index_says_is_refused(written):
    file, index = written
    longer = {**index, "a": {**index["a"], "shape": [1 << 40, 3]}}
    with pytest.raises(BakeError, match="array 'a' does not lie in it: restore it"):
        read_arrays(file, longer, "restore it")
    file.write_bytes(file.read_bytes()[:70])
    with pytest.raises(BakeError, match="does not lie in it"):
        read_arrays(file, index, "restore it")
    file.write_bytes(b"something else")
    with pytest.raises(BakeError, match="no file of arrays"):
        read_arrays(file, index, "restore it")


@pytest.mark.parametrize("kind", ["|O", "<U4", "nonsense", "float32", "V8"])
def test_only_numbers_are_read(kind):
    with pytest.raises(Refused, match="no type of numbers"):
        ARRAY_INDEX({"a": {"type": kind, "shape": [1], "first_byte": 64}}, "arrays")


def test_only_numbers_are_written(tmp_path):
    with workplace(tmp_path / "out", "test") as place, pytest.raises(TypeError, match="no numbers"):
        write_arrays(place.new / "x.bin", {"a": np.array([object()])})
