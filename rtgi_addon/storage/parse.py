"""The one parser of documents this program reads back: strict JSON, held to a schema.

A schema is made of checks, functions ``check(value, where)`` that raise ``Refused`` with where in the document something is wrong
and what. Whatever a file holds, reading it gives values that the schema allows or one BakeError: never a number that is not finite,
a key twice, a name outside its folder, or an error of Python's own.
"""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import BakeError
from .reading import read_file

Check = Callable[[object, str], None]

# A bundle of a thousand volumes has about 5 MB; empty lists of this many bytes still stay below half a GiB once they are parsed.
MAX_BYTES = 16 * 2**20
# Below this ratio of the shortest to the longest axis a matrix has no inverse worth having (as in scene/checks.py).
_SINGULAR = 1e-7
_MAX_QUOTED = 60
# What ``names.folder_names`` and the writers give: no other file system reads such a name in another way.
_FILE_NAME = re.compile(r"[A-Za-z0-9._-]+(/[A-Za-z0-9._-]+)*")
_DIGEST = re.compile(r"[0-9a-f]{64}")


class Refused(ValueError):
    """A document that is no JSON or does not keep to its schema; the message says where and what, as the end of a sentence that
    began with the file."""


def read_document(path, schema: str, check: Check, remedy: str) -> dict:
    """The JSON object in the file at ``path``, which must carry ``schema`` (name and version, `rtgi-bundle/1`) and pass ``check``.

    Raises BakeError naming the file and what is wrong with it; ``remedy`` is what to do about a damaged one.
    """
    return parse_document(read_file(path, MAX_BYTES), path, schema, check, remedy)


def parse_document(data: bytes, path, schema: str, check: Check, remedy: str) -> dict:
    """As ``read_document``, of the bytes of the file at ``path``."""
    try:
        document = parse_json(data)
        if not isinstance(document, dict):
            raise Refused(f"it holds {_kind(document)} instead of an object")
        found = document.get("schema")
        if found != schema:
            if isinstance(found, str) and found.rpartition("/")[0] == schema.rpartition("/")[0]:
                raise BakeError(f"{path} has schema {quoted(found)} instead of {schema!r}",
                                f"use the rtgi that wrote it, or {remedy}")
            raise Refused(f"its schema is {quoted(found)} instead of {schema!r}")
        check(document, "")
    except Refused as error:
        raise BakeError(f"{path} is damaged, {error}", remedy) from error
    return document


def parse_json(data: bytes):
    """The value of a JSON text in UTF-8. Raises Refused for anything else, for NaN and infinity, and for a key twice."""
    try:
        return json.loads(data.decode("utf-8"), object_pairs_hook=_object, parse_constant=_constant, parse_float=_float)
    except Refused:
        raise
    except (ValueError, RecursionError) as error:
        raise Refused("it is not JSON") from error


def _object(pairs: list[tuple[str, object]]) -> dict:
    values: dict = {}
    for key, value in pairs:
        if key in values:
            raise Refused(f"{quoted(key)} stands in it twice")
        values[key] = value
    return values


def _constant(name: str):
    raise Refused(f"{name} stands for a number")


def _float(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise Refused(f"the number {quoted(text)} is too large")
    return value


def quoted(value) -> str:
    """``value`` as it may stand in a line for a person: on one line, without control characters, cut where it is long."""
    text = ascii(value) if isinstance(value, str) and not value.isprintable() else repr(value)
    return text if len(text) <= _MAX_QUOTED else text[:_MAX_QUOTED] + "…"


def _kind(value) -> str:
    if value is None:
        return "nothing"
    kinds = {bool: "yes or no", int: "a number", float: "a number", str: "text", list: "a list", dict: "an object"}
    return kinds[type(value)]


def anything(value, where: str) -> None:
    """Any JSON value."""


def text(value, where: str) -> None:
    """Any text."""
    if not isinstance(value, str):
        raise Refused(f"{where} is {_kind(value)} instead of text")


def flag(value, where: str) -> None:
    """True or false."""
    if not isinstance(value, bool):
        raise Refused(f"{where} is {_kind(value)} instead of yes or no")


def or_nothing(check: Check) -> Check:
    """Null, or what passes ``check``."""
    return lambda value, where: None if value is None else check(value, where)


def exactly(expected: str) -> Check:
    """The one text ``expected``."""
    def check(value, where: str) -> None:
        if value != expected:
            raise Refused(f"{where} is {quoted(value)} instead of {expected!r}")

    return check


def one_of(*known: str) -> Check:
    """One of the texts ``known``."""
    def check(value, where: str) -> None:
        if value not in known:
            raise Refused(f"{where} is {quoted(value)} instead of one of {', '.join(known)}")

    return check


def number(low: float = -1e300, high: float = 1e300) -> Check:
    """A number from ``low`` to ``high``."""
    def check(value, where: str) -> None:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise Refused(f"{where} is {_kind(value)} instead of a number")
        if not low <= value <= high:
            raise Refused(f"{where} is {quoted(value)}, not from {low:g} to {high:g}")

    return check


def whole(low: int | None = None, high: int | None = None) -> Check:
    """A whole number from ``low`` to ``high``, each of them inclusive and None for no limit."""
    limits = f"at least {low}" if high is None else f"from {low} to {high}"

    def check(value, where: str) -> None:
        if isinstance(value, bool) or not isinstance(value, int):
            raise Refused(f"{where} is {quoted(value)} instead of a whole number")
        if (low is not None and value < low) or (high is not None and value > high):
            raise Refused(f"{where} is {quoted(value)}, not {limits}")

    return check


def listing(check_entry: Check, length: int | None = None) -> Check:
    """A list of ``length`` entries (None: any number), each of which passes ``check_entry``."""
    def check(value, where: str) -> None:
        if not isinstance(value, list):
            raise Refused(f"{where} is {_kind(value)} instead of a list")
        if length is not None and len(value) != length:
            raise Refused(f"{where} has {len(value)} entries instead of {length}")
        for index, entry in enumerate(value):
            check_entry(entry, f"{where}[{index}]")

    return check


def record(required: dict[str, Check], optional: dict[str, Check] | None = None) -> Check:
    """An object with every key of ``required``, any of ``optional`` and no other."""
    known = required | (optional or {})

    def check(value, where: str) -> None:
        if not isinstance(value, dict):
            raise Refused(f"{where} is {_kind(value)} instead of an object")
        missing = next((key for key in required if key not in value), None)
        if missing is not None:
            raise Refused(f"{_below(where, missing)} is missing")
        for key, entry in value.items():
            if key not in known:
                raise Refused(f"{_below(where, quoted(key))} is unknown")
            known[key](entry, _below(where, key))

    return check


def table(check_key: Check, check_entry: Check) -> Check:
    """An object with any keys that pass ``check_key``, whose values pass ``check_entry``."""
    def check(value, where: str) -> None:
        if not isinstance(value, dict):
            raise Refused(f"{where} is {_kind(value)} instead of an object")
        for key, entry in value.items():
            check_key(key, f"a name in {where}")
            check_entry(entry, f"{where}[{quoted(key)}]")

    return check


def _below(where: str, key: str) -> str:
    return f"{where}.{key}" if where else key


_rows = listing(listing(number(-1e30, 1e30), 4), 4)


def affine(value, where: str) -> None:
    """A 4×4 matrix, row major, that maps points to points and can be inverted."""
    _rows(value, where)
    matrix = np.array(value, np.float64)
    if not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        raise Refused(f"{where} is no affine matrix, its last row is {quoted(value[3])}")
    axes = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if axes[2] <= _SINGULAR * axes[0]:
        raise Refused(f"{where} has no inverse")


def file_name(value, where: str) -> None:
    """The name of a file relative to the folder of the document, inside of it: parts of ASCII letters, digits, `.`, `_` and `-`,
    joined by `/`."""
    if not isinstance(value, str) or not _FILE_NAME.fullmatch(value) or any(part.strip(".") == "" for part in value.split("/")):
        raise Refused(f"{where} is {quoted(value)}, which names no file inside the folder")


def digest(value, where: str) -> None:
    """A SHA-256 as 64 hexadecimal digits."""
    if not isinstance(value, str) or not _DIGEST.fullmatch(value):
        raise Refused(f"{where} is {quoted(value)} instead of a SHA-256")


def require_inside(folder: Path, name: str) -> Path:
    """The path of the file ``name`` (see ``file_name``) in ``folder``. Raises BakeError if a link leads it outside."""
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # links in a circle, until Python 3.13
        inside = False
    if not inside:
        raise BakeError(f"{path} is a link that leads outside of {folder}", "put the file itself there")
    return path
