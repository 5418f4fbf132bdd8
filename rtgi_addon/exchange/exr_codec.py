"""The part of OpenEXR that bundles need, in numpy and zlib: one part, scanlines, whole pixels, half and float, ZIP.

Not the OpenEXR package: on Linux a real Blender has its own libOpenEXRCore loaded already, and the dynamic linker hands *its*
``exr_*`` functions to the package, whose structures are those of another version. (``RTLD_DEEPBIND`` is no way out: it also
bypasses the allocator that Blender puts in malloc's place.) Without it nothing but Embree is native here.

Sources: https://openexr.com/en/latest/OpenEXRFileLayout.html; the ZIP transform is ImfZip.cpp's: bytes split into even and odd
ones, then differences.
"""

import io
import struct
import zlib
from collections.abc import Iterable
from typing import BinaryIO

import numpy as np

MAGIC = b"v/1\x01"

_VERSION, _LONG_NAMES = 2, 0x400
_TYPES = {1: np.dtype("<f2"), 2: np.dtype("<f4")}
_CODES = {dtype: code for code, dtype in _TYPES.items()}
# Scanlines of a chunk by compression code: none, ZIP of single lines, ZIP of 16.
_LINES = {0: 1, 2: 1, 3: 16}
_ZIP = 3
# OpenEXR's own default.
_LEVEL = 4
_SHORT, _LONG = 31, 255
# What stands before a chunk's bytes: its first scanline and how many bytes they are.
_CHUNK_HEADER = 8


class DamagedFile(ValueError):
    """The bytes are no complete EXR file."""


class UnknownLayout(ValueError):
    """An EXR file, but of a kind that this module does not read: tiles, several parts, other compressions or pixel types."""


def encode(channels: dict[str, np.ndarray], attributes: dict[str, str]) -> bytes:
    """A file of ``channels`` (name → (height, width) float16 or float32, all of one size, scanline 0 at the top) and text
    ``attributes``. The same input gives the same bytes."""
    planes = {name: np.asarray(plane) for name, plane in channels.items()}
    file, size = io.BytesIO(), next(iter(planes.values())).shape
    encode_strips(file, {name: plane.dtype for name, plane in planes.items()}, size, attributes, [planes])
    return file.getvalue()


def encode_strips(file: BinaryIO, types: dict[str, np.dtype], size: tuple[int, int], attributes: dict[str, str],
                  strips: Iterable[dict[str, np.ndarray]]) -> None:
    """As ``encode``, into ``file``, of an image of ``size`` (height, width) that comes in ``strips`` from the top, each of any
    height; ``types`` are those of its channels."""
    names, (height, width) = sorted(types, key=str.encode), size
    types = {name: np.dtype(types[name]).newbyteorder("<") for name in names}
    header = _header({name: _CODES[kind] for name, kind in types.items()}, width, height, attributes)
    offsets = np.zeros(-(-height // _LINES[_ZIP]), "<u8")
    file.write(header + offsets.tobytes())
    left, done = np.zeros((0, width * sum(kind.itemsize for kind in types.values())), np.uint8), 0
    for strip in strips:
        planes = [np.ascontiguousarray(strip[name], kind) for name, kind in types.items()]
        if any(plane.shape != (len(planes[0]), width) for plane in planes):
            raise ValueError("channels differ in size")
        lines = np.concatenate([plane.view(np.uint8).reshape(len(plane), -1) for plane in planes], axis=1)
        lines = np.concatenate([left, lines]) if len(left) else lines
        whole = len(lines) if done + len(lines) == height else len(lines) // _LINES[_ZIP] * _LINES[_ZIP]
        for top in range(0, whole, _LINES[_ZIP]):
            chunk = _pack(lines[top:min(top + _LINES[_ZIP], whole)].reshape(-1))
            offsets[(done + top) // _LINES[_ZIP]] = file.tell()
            file.write(struct.pack("<2i", done + top, len(chunk)))
            file.write(chunk)
        left, done = lines[whole:], done + whole
    if done != height:
        raise ValueError(f"{done + len(left)} lines of {height}")
    file.seek(len(header))
    file.write(offsets.tobytes())


def decode(data: bytes, size: tuple[int, int] | None = None) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """(name → (height, width) float16 or float32, text attributes) of a file's bytes, of which every one is accounted for.

    Raises DamagedFile or UnknownLayout, before any pixel is unpacked if the image is not of ``size`` (height, width). Never reads
    or allocates beyond what the data could hold, and no pixel is anything but what the file says.
    """
    try:
        return _decode(data, size)
    except (struct.error, IndexError, KeyError, UnicodeDecodeError, zlib.error) as error:
        raise DamagedFile(str(error)) from error


def _decode(data: bytes, size: tuple[int, int] | None) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    magic, version = struct.unpack_from("<4si", data)
    if magic != MAGIC:
        raise DamagedFile("not an EXR file")
    if version & ~_LONG_NAMES != _VERSION:
        raise UnknownLayout(f"version and kind {version:#x}")
    attributes, table = _read_attributes(data, 8)
    layout = _read_channels(attributes["channels"][1])
    compression = attributes["compression"][1][0]
    if compression not in _LINES:
        raise UnknownLayout(f"compression {compression}")
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"][1])
    width, height, chunk_lines = right - left + 1, bottom - top + 1, _LINES[compression]
    if size is not None and (height, width) != size:
        raise DamagedFile(f"{width} × {height} pixels instead of {size[1]} × {size[0]}")
    line_bytes = width * sum(dtype.itemsize for _, dtype in layout)
    # Deflate packs 1032 to 1 at best: a window beyond that is a damaged header, and no reason to ask for its memory.
    if width < 1 or height < 1 or line_bytes * height > 1032 * len(data):
        raise DamagedFile("the data window does not fit the file")

    chunks = _find_chunks(data, table, -(-height // chunk_lines))
    lines = np.empty((height, line_bytes), np.uint8)
    unread = set(range(0, height, chunk_lines))
    for begin, end in chunks:
        first = struct.unpack_from("<i", data, begin)[0] - top
        if first not in unread:
            raise DamagedFile("a chunk lies outside the image or is there twice")
        unread.remove(first)
        rows = lines[first:first + chunk_lines]
        rows[...] = _unpack(data[begin + _CHUNK_HEADER:end], rows.size).reshape(rows.shape)

    planes, column = {}, 0
    for name, dtype in layout:
        end = column + width * dtype.itemsize
        planes[name] = np.ascontiguousarray(lines[:, column:end]).view(dtype)
        column = end
    return planes, {name: value.decode() for name, (kind, value) in attributes.items() if kind == "string"}


def _find_chunks(data: bytes, table: int, count: int) -> list[tuple[int, int]]:
    """(begin, end) of each of ``count`` chunks, whose offsets begin at ``table``: all that follows the table, without a gap or a
    byte in two of them."""
    begin = table + 8 * count
    if begin > len(data):
        raise DamagedFile("the table of chunks is cut short")
    offsets = struct.unpack_from(f"<{count}Q", data, table)
    chunks = []
    for offset in sorted(offsets):
        if offset != begin:
            raise DamagedFile("a chunk does not begin where the one before it ends")
        size, = struct.unpack_from("<i", data, offset + 4)
        begin = offset + _CHUNK_HEADER + size
        if size < 0 or begin > len(data):
            raise DamagedFile("a chunk is cut short")
        chunks.append((offset, begin))
    if begin != len(data):
        raise DamagedFile("something follows the last chunk")
    return chunks


def _pack(raw: np.ndarray) -> bytes:
    """One chunk's bytes (n,), deflated; as they are where that saves nothing, which readers tell by the size."""
    split = np.concatenate((raw[::2], raw[1::2]))
    difference = split.copy()
    difference[1:] -= split[:-1]
    difference[1:] += 128
    packed = zlib.compress(difference.tobytes(), _LEVEL)
    return packed if len(packed) < raw.size else raw.tobytes()


def _unpack(packed: bytes, size: int) -> np.ndarray:
    """The inverse of ``_pack`` for a chunk of ``size`` bytes."""
    if len(packed) >= size:
        if len(packed) > size:
            raise DamagedFile("a chunk is too long")
        return np.frombuffer(packed, np.uint8)
    inflater = zlib.decompressobj()
    difference = np.frombuffer(inflater.decompress(packed, size), np.uint8).copy()
    # A stream that would go on is refused here, before it is unpacked any further.
    if difference.size != size or not inflater.eof or inflater.unused_data:
        raise DamagedFile("a chunk holds more or less than its lines")
    difference[1:] += 128
    split = np.cumsum(difference, dtype=np.uint8)
    raw, half = np.empty(size, np.uint8), -(-size // 2)
    raw[::2], raw[1::2] = split[:half], split[half:]
    return raw


def _header(channels: dict[str, int], width: int, height: int, texts: dict[str, str]) -> bytes:
    """Magic, version and attributes, sorted by name as the OpenEXR library leaves them."""
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    listed = b"".join(_name(name) + struct.pack("<iB3x2i", code, 0, 1, 1) for name, code in channels.items()) + b"\0"
    attributes = {
        "channels": ("chlist", listed),
        "compression": ("compression", bytes([_ZIP])),
        "dataWindow": ("box2i", window),
        "displayWindow": ("box2i", window),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", struct.pack("<f", 1.0)),
        "screenWindowCenter": ("v2f", struct.pack("<2f", 0.0, 0.0)),
        "screenWindowWidth": ("float", struct.pack("<f", 1.0)),
        **{name: ("string", text.encode()) for name, text in texts.items()},
    }
    longest = max(len(name.encode()) for name in (*attributes, *channels))
    version = _VERSION | (_LONG_NAMES if longest > _SHORT else 0)
    body = b"".join(_name(name) + _name(kind) + struct.pack("<i", len(value)) + value
                    for name, (kind, value) in sorted(attributes.items()))
    return MAGIC + struct.pack("<i", version) + body + b"\0"


def _read_attributes(data: bytes, at: int) -> tuple[dict[str, tuple[str, bytes]], int]:
    """(name → (type, value), where the header ends)."""
    attributes = {}
    while data[at]:
        name, at = _read_name(data, at)
        kind, at = _read_name(data, at)
        size, = struct.unpack_from("<i", data, at)
        at += 4
        if size < 0 or at + size > len(data):
            raise DamagedFile("an attribute is cut short")
        if name in attributes:
            raise DamagedFile("an attribute is there twice")
        attributes[name] = (kind, data[at:at + size])
        at += size
    return attributes, at + 1


def _read_channels(value: bytes) -> list[tuple[str, np.dtype]]:
    """(name, type) in the order of the file."""
    found, at = {}, 0
    while value[at]:
        name, at = _read_name(value, at)
        code, *sampling = struct.unpack_from("<i4x2i", value, at)
        at += 16
        if code not in _TYPES or sampling != [1, 1]:
            raise UnknownLayout(f"channel {name} holds other than whole pixels of half or float")
        if name in found:
            raise DamagedFile("a channel is there twice")
        found[name] = _TYPES[code]
    if at + 1 != len(value) or not found:
        raise DamagedFile("the list of channels does not end where it should")
    return list(found.items())


def _name(text: str) -> bytes:
    data = text.encode()
    if not 0 < len(data) <= _LONG or b"\0" in data:
        raise ValueError(f"{text!r} cannot name a part of an EXR file")
    return data + b"\0"


def _read_name(data: bytes, at: int) -> tuple[str, int]:
    """The text up to the next zero, and where what follows it begins."""
    end = data.find(b"\0", at, at + _LONG + 1)
    if end < 0:
        raise DamagedFile("a name does not end")
    return data[at:end].decode(), end + 1
