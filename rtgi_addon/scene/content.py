"""What parts of a scene hold, as hashes."""

import hashlib
from dataclasses import fields, is_dataclass

import numpy as np


def content_hash(value) -> str:
    """A hash of nested dataclasses, tuples, dictionaries, arrays and plain values, by content."""
    digest = hashlib.blake2b(digest_size=16)
    _feed(digest, value)
    return digest.hexdigest()


def _feed(digest, value) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"a{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif is_dataclass(value):
        digest.update(f"d{type(value).__name__}".encode())
        for item in fields(value):
            if item.metadata.get("look"):
                continue
            _feed(digest, item.name)
            _feed(digest, getattr(value, item.name))
    elif isinstance(value, (tuple, list)):
        digest.update(f"l{len(value)}".encode())
        for item in value:
            _feed(digest, item)
    elif isinstance(value, dict):
        digest.update(f"m{len(value)}".encode())
        for key in sorted(value, key=repr):
            _feed(digest, key)
            _feed(digest, value[key])
    else:
        text = repr(value.item() if isinstance(value, np.generic) else value)
        digest.update(f"v{len(text)}:{text}".encode())
