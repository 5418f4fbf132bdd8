"""The parser of documents: what a schema allows or one clear error, whatever the bytes are."""

import json
import os

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.storage import reading
from rtgi_addon.storage.parse import (
    Refused,
    affine,
    exactly,
    file_name,
    flag,
    listing,
    number,
    parse_document,
    parse_json,
    quoted,
    read_document,
    record,
    table,
    text,
    whole,
)
from rtgi_addon.storage.reading import read_file

SCHEMA = "rtgi-test/2"
CHECK = record({"schema": text, "count": whole(1, 9), "names": listing(file_name), "share": number(0.0, 1.0)},
               {"kept": table(text, flag), "kind": exactly("cell-centred")})
GOOD = {"schema": SCHEMA, "count": 3, "names": ["a/b.exr"], "share": 0.5, "kept": {"x": True}}


def read(tmp_path, content):
    path = tmp_path / "file.json"
    path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
    return read_document(path, SCHEMA, CHECK, "bake again")


def test_what_keeps_to_the_schema_is_read(tmp_path):
    assert read(tmp_path, GOOD) == GOOD


@pytest.mark.parametrize(("change", "words"), [
    ({"count": 0}, "count is 0, not from 1 to 9"), ({"count": 1.0}, "count is 1.0 instead of a whole number"),
    ({"count": None}, "count is None instead of a whole number"), ({"share": "0.5"}, "share is text instead of a number"),
    ({"share": -0.1}, "share is -0.1, not from 0 to 1"), ({"share": 10**500}, r"share is 1000.*…, not from 0 to 1"),
    ({"names": ["../x"]}, r"names\[0\] is '\.\./x', which names no file inside"),
    ({"names": {}}, "names is an object instead of a list"),
    ({"kept": {"x": 1}}, r"kept\['x'\] is a number instead of yes or no"), ({"kind": "x"}, "kind is 'x' instead of 'cell-centred'"),
    ({"more": 1}, "'more' is unknown"), ({"a\nb": 1}, r"'a\\nb' is unknown"),
])
def test_what_does_not_is_named(tmp_path, change, words):
    with pytest.raises(BakeError, match=r"file\.json is damaged, " + words) as caught:
        read(tmp_path, GOOD | change)
    assert caught.value.remedy == "bake again" and "\n" not in str(caught.value)


def test_another_version_is_not_damage(tmp_path):
    with pytest.raises(BakeError, match=r"has schema 'rtgi-test/3' instead of 'rtgi-test/2'.* use the rtgi that wrote it"):
        read(tmp_path, GOOD | {"schema": "rtgi-test/3"})
    with pytest.raises(BakeError, match="is damaged, its schema is 'rtgi-other/2' instead of"):
        read(tmp_path, GOOD | {"schema": "rtgi-other/2"})


def test_no_bytes_raise_anything_but_one_clear_error():
    """Bytes changed, removed, repeated and put in, of a document that uses every check."""
    data = json.dumps(GOOD).encode()
    pieces = [b"", b"\xff", b"{", b"[" * 3000, b"1e999", b"NaN", b"-0", b"null", b'"\\ud800"', b"\\u0000", b",", b'"schema":1,',
              b"9" * 5000]
    rng = np.random.default_rng(3)
    refused = 0
    for _ in range(3000):
        first, last = np.sort(rng.integers(0, len(data) + 1, 2))
        last = min(last, first + 3)
        try:
            parse_document(data[:first] + pieces[rng.integers(len(pieces))] + data[last:], "file.json", SCHEMA, CHECK, "bake again")
        except BakeError as error:
            refused += 1
            assert "file.json" in error.cause and error.remedy and str(error).isprintable()
    assert refused > 2500


@pytest.mark.parametrize("value", [
    np.eye(3).tolist(), np.zeros((4, 4)).tolist(), np.diag([1.0, 1.0, 1e-9, 1.0]).tolist(), np.eye(4).tolist()[::-1],
    [[1, 0, 0, "x"], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], [[1e31, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]])
def test_a_matrix_can_be_inverted(value):
    affine(np.diag([1.0, 2.0, -3.0, 1.0]).tolist(), "matrix")
    with pytest.raises(Refused, match="matrix"):
        affine(value, "matrix")


@pytest.mark.parametrize("value", ["a\x1b[31mb", "x" * 1000, "a\nb", "\ud800", {"a": "\x07"}])
def test_what_is_quoted_is_one_short_line(value):
    assert quoted(value).isprintable() and len(quoted(value)) < 70


def test_numbers_are_finite():
    for content in (b"[NaN]", b"[-Infinity]", b"[1e400]", b"[-1e400]"):
        with pytest.raises(Refused):
            parse_json(content)
    assert parse_json(b"[1e300]") == [1e300]


def test_only_ordinary_files_are_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, words in ((tmp_path / "pipe", "not a file"), ("/dev/zero", "not a file"), (tmp_path / "none", "no such file"),
                        (tmp_path, "is a folder where a file should be")):
        with pytest.raises(BakeError, match=words):
            read_file(path, 100)
    (tmp_path / "file").write_bytes(bytes(101))
    assert read_file(tmp_path / "file", 101) == bytes(101)
    with pytest.raises(BakeError, match="has 101 bytes, which is more than the 100 it may have"):
        read_file(tmp_path / "file", 100)


def test_a_pipe_that_took_a_files_place_does_not_hang(tmp_path, monkeypatch):
    """Looked at while it was a file, opened when it was a pipe."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "file").write_bytes(b"x")
    ordinary, looked = os.stat(tmp_path / "file"), []

    def stat(path):
        looked.append(path)
        return ordinary

    monkeypatch.setattr(reading.os, "stat", stat)
    with pytest.raises(BakeError, match="not a file"):
        read_file(tmp_path / "pipe", 100)
    assert looked
