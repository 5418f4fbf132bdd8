"""Many arrays in one file, mapped into memory when it is read: a process pays for what it touches, not for what lies there.

Plain little-endian numbers, each array at a multiple of 64 bytes; an index in a JSON document beside it says type, shape and place.
Nothing in such a file is ever run.
"""

import mmap
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import BakeError
from .files import disk_error
from .parse import Refused, listing, quoted, record, table, text, whole
from .reading import open_file
from .writing import claim

_MAGIC, _ALIGNMENT = b"rtgi-arrays/1\n", 64
# Truth values, whole numbers and floats; objects and texts are what a document is for.
_KINDS = "biuf"
_MOST = 1 << 60


def _type(value, where: str) -> None:
    text(value, where)
    try:
        kind = np.dtype(value)
    except TypeError:
        raise Refused(f"{where} is {quoted(value)}, which is no type of numbers") from None
    if kind.kind not in _KINDS or kind.str != value:
        raise Refused(f"{where} is {quoted(value)}, which is no type of numbers")


# What ``write_arrays`` returns, as a part of a document's schema.
ARRAY_INDEX = table(text, record({"type": _type, "shape": listing(whole(0, _MOST)), "first_byte": whole(_ALIGNMENT, _MOST)}))


def write_arrays(path, arrays: Mapping[str, np.ndarray]) -> dict:
    """Write ``arrays`` as the file ``path`` in a workplace's ``new`` and return its index (ARRAY_INDEX). Raises OSError."""
    index, place = {}, _ALIGNMENT
    with open(claim(path), "wb") as file:
        file.write(_MAGIC.ljust(_ALIGNMENT, b"\0"))
        for name, array in arrays.items():
            array = np.asarray(array)
            if array.dtype.kind not in _KINDS:
                raise TypeError(f"array {name!r} holds {array.dtype}, no numbers")
            array = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).reshape(array.shape)
            file.write(b"\0" * (place - file.tell()))
            index[name] = {"type": array.dtype.str, "shape": list(array.shape), "first_byte": place}
            if array.size:
                file.write(array.data)
            place += -(-array.nbytes // _ALIGNMENT) * _ALIGNMENT
    return index


def read_arrays(path, index: Mapping[str, Mapping], remedy: str) -> dict[str, np.ndarray]:
    """The arrays that ``index`` finds in the file at ``path``, read-only and read from the disk as they are used. Raises BakeError
    with ``remedy`` for a file that is missing or no such file, or does not hold what the index says."""
    path = Path(path)
    with open_file(path) as (file, size):
        if file.read(len(_MAGIC)) != _MAGIC:
            raise BakeError(f"{path} is damaged, it is no file of arrays", remedy)
    try:
        data = np.memmap(path, np.uint8, mode="r")
    except OSError as error:
        raise disk_error(path, error, doing="read") from error
    arrays = {}
    for name, entry in index.items():
        kind, first = np.dtype(entry["type"]), entry["first_byte"]
        count = 1
        for side in entry["shape"]:
            count *= side
        if first + count * kind.itemsize > size or first % _ALIGNMENT:
            raise BakeError(f"{path} is damaged, array {name!r} does not lie in it", remedy)
        arrays[name] = np.frombuffer(data, kind, count, first).reshape(entry["shape"]) if count else np.zeros(entry["shape"], kind)
    return arrays


def let_go(arrays: Mapping[str, np.ndarray]) -> None:
    """Free the memory that ``arrays`` of one file (``read_arrays``) take up after they were used; they are read from the disk
    again when they are. Where the system has no way to, nothing happens."""
    base = next((array for array in arrays.values() if array.size), None)
    while base is not None and not isinstance(base, mmap.mmap):
        base = base.obj if isinstance(base, memoryview) else getattr(base, "base", None)
    if base is not None and hasattr(mmap, "MADV_DONTNEED"):
        base.madvise(mmap.MADV_DONTNEED)
