"""Random changes of what is read back: of bytes, of JSON documents by their values, of images by their parts."""

import hashlib
import json

import numpy as np

NUMBERS = (0, -1, 1, 2, 3, 7, 255, 1 << 31, 1 << 53, 1 << 63, -(1 << 63), 10**40, 0.5, -0.0, 1e-300, 1e300, 1e999)
TEXTS = ("", ".", "..", "../bake.json", "/etc/passwd", "bake.json", "Volume/sh0.exr", "\0", "\x1b[2J", "a" * 10000, "ü", "\ud800",
         "C:/x", "a\\b", "CON", "Volume/../Volume/sh0.exr", "Volume//sh0.exr", "nul", "0" * 64, "f" * 64)


def changed_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """``data`` with a few bits, bytes or stretches of it changed, cut, doubled or exchanged."""
    data = bytearray(data)
    for _ in range(int(rng.choice([1, 1, 1, 2, 5]))):
        size = max(len(data), 1)
        place, length = int(rng.integers(size)), int(rng.integers(1, min(64, size) + 1))
        kind = int(rng.integers(9))
        if kind <= 2 and data:
            data[place] ^= 1 << int(rng.integers(8))
        elif kind == 3 and data:
            data[place] = int(rng.integers(256))
        elif kind == 4:
            del data[place:]
        elif kind == 5:
            data[place:place] = data[place:place + length]
        elif kind == 6:
            del data[place:place + length]
        elif kind == 7:
            data[place:place + length] = bytes(length)
        else:
            other = int(rng.integers(size))
            one, two = sorted((place, other))
            length = min(length, two - one, size - two)
            data[one:one + length], data[two:two + length] = data[two:two + length], data[one:one + length]
    return bytes(data)


def changed_json(data: bytes, rng: np.random.Generator) -> bytes:
    """A JSON text with one of its values replaced, taken away, renamed, doubled or moved."""
    try:
        document = json.loads(data)
    except ValueError:
        return changed_bytes(data, rng)
    places = list(_places(document, []))
    path = places[int(rng.integers(len(places)))]
    holder = document
    for key in path[:-1]:
        holder = holder[key]
    key, value = path[-1], holder[path[-1]]
    kind = int(rng.integers(7))
    if kind <= 2:
        holder[key] = _other(value, rng)
    elif kind == 3:
        del holder[key]
    elif kind == 4 and isinstance(holder, dict):
        holder[str(TEXTS[int(rng.integers(len(TEXTS)))])] = holder.pop(key)
    elif kind == 5 and isinstance(holder, list):
        holder.insert(int(rng.integers(len(holder) + 1)), value)
    else:
        other = places[int(rng.integers(len(places)))]
        there = document
        for step in other[:-1]:
            there = there[step]
        holder[key] = there[other[-1]] if not isinstance(there[other[-1]], (dict, list)) else None
    text = json.dumps(document, indent=1)
    if rng.random() < 0.1:
        word = rng.choice(["NaN", "Infinity", "1e999", "[" * 3000, '{"a": 1, "a": 1}', "0x10", "1" * 5000])
        text = text.replace("1", str(word), 1)
    return (text + "\n").encode("utf-8", "surrogatepass")


def _places(value, path):
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield [*path, key]
        yield from _places(inner, [*path, key])


def _other(value, rng: np.random.Generator):
    kind = int(rng.integers(6))
    if kind == 0 and isinstance(value, (int, float)) and not isinstance(value, bool):
        return value + float(rng.choice([1, -1, 0.5, 1e-9])) if isinstance(value, float) else value + int(rng.choice([1, -1, 2]))
    if kind <= 2:
        return NUMBERS[int(rng.integers(len(NUMBERS)))]
    if kind == 3:
        return TEXTS[int(rng.integers(len(TEXTS)))]
    return [None, True, False, [], {}, [[]], {"a": {}}, [value], {"x": value}, not value][int(rng.integers(10))]


def reseal_manifest(data: bytes) -> bytes:
    """bake.json with the checksum of itself that its content asks for."""
    try:
        stated = json.loads(data)["stats"]["checksum"]
    except (ValueError, KeyError, TypeError):
        return data
    if not isinstance(stated, str) or not stated:
        return data
    zeros = data.replace(json.dumps(stated).encode(), json.dumps("0" * 64).encode())
    return zeros.replace(b'"' + b"0" * 64 + b'"', b'"' + hashlib.sha256(zeros).hexdigest().encode() + b'"')


def changed_image(data: bytes, rng: np.random.Generator) -> bytes:
    """An EXR with its header, its offset table or its chunks changed, or its chunks left out, doubled or exchanged."""
    if rng.random() < 0.4:
        # The header and the table of offsets are the first few hundred bytes.
        head = int(rng.integers(40, min(900, len(data))))
        return changed_bytes(data[:head], rng) + data[head:]
    return changed_bytes(data, rng)
