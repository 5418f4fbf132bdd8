"""The EXR codec against the OpenEXR library, both ways, and against damage."""

import struct
import tracemalloc
import zlib

import numpy as np
import pytest

from rtgi_addon.exchange.exr_codec import DamagedFile, UnknownLayout, decode, encode


def planes(height, width, dtype=np.float32, names="RGB"):
    """Smooth values with some noise, another plane per name."""
    rng = np.random.default_rng(2)
    ramp = np.add.outer(np.arange(height), np.arange(width) / 7)
    return {name: (np.sin(ramp + index) + 0.01 * rng.random((height, width))).astype(dtype) for index, name in enumerate(names)}


SHAPES = [(1, 1), (1, 7), (15, 3), (16, 3), (17, 3), (50, 33)]


@pytest.fixture
def library():
    """The reference implementation, which the product does without."""
    return pytest.importorskip("OpenEXR", reason="the OpenEXR package is not installed")


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("shape", SHAPES)
def test_openexr_reads_what_we_write(tmp_path, library, shape, dtype):
    written = planes(*shape, dtype)
    (tmp_path / "a.exr").write_bytes(encode(written, {"note": "Größe", "a name of more than thirty-one characters": "x"}))
    with library.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        assert file.header()["note"] == "Größe"
        assert file.header()["compression"] == library.ZIP_COMPRESSION
        read = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
    assert {name: plane.dtype for name, plane in read.items()} == dict.fromkeys("RGB", np.dtype(dtype))
    assert all(np.array_equal(read[name], written[name]) for name in "RGB")


@pytest.mark.parametrize("compression", ["NO", "ZIPS", "ZIP"])
@pytest.mark.parametrize("shape", SHAPES)
def test_we_read_what_openexr_writes(tmp_path, library, shape, compression):
    written = planes(*shape)
    header = {"compression": getattr(library, f"{compression}_COMPRESSION"), "type": library.scanlineimage, "note": "x"}
    library.File(header, dict(written)).write(str(tmp_path / "a.exr"))
    read, attributes = decode((tmp_path / "a.exr").read_bytes())
    assert attributes["note"] == "x"
    assert set(read) == set("RGB") and all(np.array_equal(read[name], written[name]) for name in "RGB")


def test_the_header_has_what_openexr_writes(tmp_path, library):
    """Attribute by attribute, types and bytes: the library must not be able to tell."""
    from rtgi_addon.exchange.exr_codec import _read_attributes
    header = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage}
    library.File(header, planes(5, 6)).write(str(tmp_path / "a.exr"))
    theirs, _ = _read_attributes((tmp_path / "a.exr").read_bytes(), 8)
    ours, _ = _read_attributes(encode(planes(5, 6), {"type": "scanlineimage"}), 8)
    assert ours.items() <= theirs.items()
    # Counts of what only tiles, parts and deep data have.
    assert set(theirs) - set(ours) <= {"version", "chunkCount"}


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_bits_survive_where_nothing_compresses(dtype):
    noise = np.random.default_rng(3).integers(0, 256, (40, 24), np.uint8).view(dtype)
    data = encode({"Y": noise}, {})
    assert len(data) > noise.nbytes
    assert decode(data)[0]["Y"].tobytes() == noise.tobytes()


def test_channels_of_two_types_stand_side_by_side():
    written = {"A": planes(20, 9, np.float16)["R"], "Z": planes(20, 9)["G"]}
    read, _ = decode(encode(written, {}))
    assert all(np.array_equal(read[name], written[name]) and read[name].dtype == written[name].dtype for name in "AZ")


def test_big_endian_and_strided_arrays_arrive():
    plane = planes(20, 10)["R"]
    read, _ = decode(encode({"Y": plane.astype(">f4")[::-1, ::2]}, {}))
    assert np.array_equal(read["Y"], plane[::-1, ::2])


def test_what_cannot_be_a_file_is_refused():
    with pytest.raises(ValueError, match="differ in size"):
        encode({"R": np.zeros((2, 2), np.float32), "G": np.zeros((2, 3), np.float32)}, {})
    for name in ("", "a\0b", "x" * 256):
        with pytest.raises(ValueError, match="cannot name"):
            encode({name: np.zeros((2, 2), np.float32)}, {})


def test_a_file_cut_at_any_byte_is_damaged():
    data = encode(planes(20, 3), {"note": "x"})
    assert decode(data)
    for length in range(len(data)):
        with pytest.raises(DamagedFile):
            decode(data[:length])


def test_a_changed_byte_never_gets_through_as_another_error():
    """Whatever a byte becomes, the file is read, damaged or unknown; nothing else is raised and no great memory asked for."""
    data = encode(planes(20, 3), {})
    refused = 0
    for at in range(4, len(data)):
        for value in (0, 0x7F, 0xFF):
            try:
                decode(data[:at] + bytes([value]) + data[at + 1:])
            except (DamagedFile, UnknownLayout):
                refused += 1
    assert refused > len(data) / 2


def chunked(height=40):
    """A file of three chunks: its bytes, where its table of offsets begins, and the offsets."""
    data = encode(planes(height, 3, names="Y"), {})
    from rtgi_addon.exchange.exr_codec import _read_attributes
    _, table = _read_attributes(data, 8)
    return data, table, struct.unpack_from("<3Q", data, table)


def with_table(data, table, offsets):
    return data[:table] + struct.pack("<3Q", *offsets) + data[table + 24:]


@pytest.mark.parametrize("order", [(0, 0, 2), (0, 1, 1), (2, 2, 2)])
def test_a_chunk_that_is_missing_and_another_twice_leaves_no_pixel_to_chance(order):
    data, table, offsets = chunked()
    with pytest.raises(DamagedFile, match="does not begin where the one before it ends"):
        decode(with_table(data, table, [offsets[index] for index in order]))


@pytest.mark.parametrize("line", [0, 16, 1, -16, 48, 2**31 - 1])
def test_a_chunk_of_lines_that_are_another_s_or_nobody_s_is_refused(line):
    data, _, offsets = chunked()
    changed = bytearray(data)
    struct.pack_into("<i", changed, offsets[2], line)
    with pytest.raises(DamagedFile, match="outside the image or is there twice"):
        decode(bytes(changed))


def test_chunks_may_be_listed_in_any_order():
    data, table, offsets = chunked()
    assert np.array_equal(decode(with_table(data, table, offsets[::-1]))[0]["Y"], planes(40, 3, names="Y")["Y"])


@pytest.mark.parametrize("shift", [-8, -1, 1, 8, 2**40])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_an_offset_into_something_else_is_refused(index, shift):
    data, table, offsets = chunked()
    moved = [offset + shift * (position == index) for position, offset in enumerate(offsets)]
    with pytest.raises(DamagedFile):
        decode(with_table(data, table, moved))


def test_bytes_after_the_last_chunk_are_refused():
    with pytest.raises(DamagedFile, match="follows the last chunk"):
        decode(chunked()[0] + b"\0")


def test_a_size_that_is_not_asked_for_is_refused_before_its_memory_is():
    """Zeros pack a thousand to one: a small file may be a great image, but not where another was expected."""
    data = encode({"Y": np.zeros((1024, 1024), np.float32)}, {})
    assert len(data) < 2**14
    tracemalloc.start()
    with pytest.raises(DamagedFile, match="1024 × 1024 pixels instead of 3 × 20"):
        decode(data, (20, 3))
    assert tracemalloc.get_traced_memory()[1] < 2**16
    tracemalloc.stop()
    assert not decode(data, (1024, 1024))[0]["Y"].any()


def test_a_chunk_that_would_unpack_to_more_is_stopped():
    data, _, offsets = chunked(height=33)
    bomb = zlib.compress(bytes(2**26), 9)
    head = bytearray(data[:offsets[2] + 8])
    struct.pack_into("<i", head, offsets[2] + 4, len(bomb))
    tracemalloc.start()
    with pytest.raises(DamagedFile, match=r"a chunk (holds more or less than its lines|is too long)"):
        decode(bytes(head) + bomb)
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()


def test_every_pixel_that_is_read_is_what_the_file_says():
    """Whatever changes, decoding twice, over memory that was filled with something else between, gives the same."""
    data = encode(planes(40, 3), {})
    rng = np.random.default_rng(5)
    read = 0
    for _ in range(3000):
        changed = bytearray(data)
        for at in rng.integers(4, len(data), rng.integers(1, 4)):
            changed[at] = rng.integers(256)
        try:
            first = decode(bytes(changed))[0]
        except (DamagedFile, UnknownLayout):
            continue
        read += 1
        noise = [rng.integers(0, 256, (40, 36), np.uint8) for _ in range(8)]
        del noise
        second = decode(bytes(changed))[0]
        assert all(plane.tobytes() == second[name].tobytes() for name, plane in first.items())
    assert read > 20


@pytest.mark.parametrize("window", [(0, 0, 2**31 - 1, 2**31 - 1), (0, 0, -2, 5), (5, 0, 4, 5), (-2**31, 0, 2**31 - 1, 0)])
def test_an_impossible_window_is_damage(window):
    data = encode(planes(20, 3), {})
    at = data.index(struct.pack("<4i", 0, 0, 2, 19))
    with pytest.raises(DamagedFile):
        decode(data[:at] + struct.pack("<4i", *window) + data[at + 16:])


@pytest.mark.parametrize("change", ["tiled", "compression", "integers"])
def test_other_kinds_of_exr_are_told_from_damage(change, library, tmp_path):
    path = tmp_path / "a.exr"
    kind = library.tiledimage if change == "tiled" else library.scanlineimage
    header = {"compression": library.PIZ_COMPRESSION if change == "compression" else library.ZIP_COMPRESSION, "type": kind}
    if change == "tiled":
        header["tiles"] = library.TileDescription()
    pixels = planes(20, 3)
    if change == "integers":
        pixels = {name: plane.astype(np.uint32) for name, plane in pixels.items()}
    library.File(header, pixels).write(str(path))
    with pytest.raises(UnknownLayout):
        decode(path.read_bytes())
