"""EXR files: what goes in comes out, the same bytes every time, and a damaged file is named."""

import numpy as np
import OpenEXR
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.exr import read_exr, write_exr


@pytest.fixture
def pixels():
    return np.random.default_rng(1).random((40, 50, 3), dtype=np.float32)


@pytest.mark.parametrize("names", ["RGB", "RG", "Y"])
def test_round_trip(tmp_path, pixels, names):
    channels = {name: pixels[..., index] for index, name in enumerate(names)}
    write_exr(tmp_path / "a.exr", channels, {"volume": "Größe", "numbers": [1, 2.5]})
    planes, metadata = read_exr(tmp_path / "a.exr")
    assert metadata == {"volume": "Größe", "numbers": [1, 2.5]}
    assert set(planes) == set(names)
    for name in names:
        assert np.array_equal(planes[name], channels[name])


@pytest.mark.parametrize("view", [lambda a: a[::-1], lambda a: a[:, ::2], np.transpose, np.float64])
def test_strided_views_arrive_unscrambled(tmp_path, pixels, view):
    plane = view(pixels[..., 1])
    write_exr(tmp_path / "a.exr", {"Y": plane}, {})
    assert np.array_equal(read_exr(tmp_path / "a.exr")[0]["Y"], plane.astype(np.float32))


def test_extreme_values_survive(tmp_path):
    plane = np.array([[np.nan, np.inf, -np.inf, 3e38, 1e-40, -0.0]], np.float32)
    write_exr(tmp_path / "a.exr", {"Y": plane}, {})
    assert read_exr(tmp_path / "a.exr")[0]["Y"].tobytes() == plane.tobytes()


def test_the_same_pixels_give_the_same_bytes(tmp_path, pixels):
    for name in ("a.exr", "b.exr"):
        write_exr(tmp_path / name, {"Y": pixels[..., 0]}, {"x": 1})
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_the_file_is_what_engines_read(tmp_path, pixels):
    write_exr(tmp_path / "a.exr", {name: pixels[..., index] for index, name in enumerate("RGB")}, {})
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        header = file.header()
        assert len(file.parts) == 1
        assert header["compression"] == OpenEXR.ZIP_COMPRESSION
        assert header["type"] == OpenEXR.scanlineimage
        assert {channel.pixels.dtype for channel in file.channels().values()} == {np.dtype(np.float32)}


@pytest.mark.parametrize("share", [0.0, 0.001, 0.01, 0.3, 0.9, 0.9999])
def test_a_truncated_file_is_named(tmp_path, pixels, share):
    path = tmp_path / "a.exr"
    write_exr(path, {"Y": pixels[..., 0]}, {})
    data = path.read_bytes()
    path.write_bytes(data[:int(share * len(data))])
    with pytest.raises(BakeError) as caught:
        read_exr(path)
    assert str(path) in caught.value.cause and caught.value.remedy


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(BakeError, match=r"cannot read .*none\.exr, no such file"):
        read_exr(tmp_path / "none.exr")


def test_a_stranger_is_refused(tmp_path, pixels):
    path = tmp_path / "a.exr"
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Y": pixels[..., 0].copy()}).write(str(path))
    with pytest.raises(BakeError, match="not written by rtgi"):
        read_exr(path)
    path.write_bytes(b"P6 1 1 255 ")
    with pytest.raises(BakeError, match="not an EXR"):
        read_exr(path)


def test_a_refused_write_says_why(tmp_path, pixels):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="not a directory") as caught:
        write_exr(tmp_path / "file" / "a.exr", {"Y": pixels[..., 0]}, {})
    assert "a part of it is a file" in caught.value.remedy
    write_exr(tmp_path / "new" / "a.exr", {"Y": pixels[..., 0]}, {})
    assert (tmp_path / "new/a.exr").is_file()
