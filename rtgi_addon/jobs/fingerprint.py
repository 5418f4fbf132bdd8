"""What a bake depends on, as hashes: a checkpoint is continued only if every one of them is the same."""

import hashlib
from dataclasses import fields, is_dataclass

import numpy as np

from ..exchange.schema import RTGI_VERSION
from ..scene import Scene

# What every technique may read. Cameras, notes and where the file lies change no probe.
_SCENE_PARTS = ("meshes", "instances", "materials", "lights", "world", "volumes")


def fingerprint(scene: Scene, technique: str, settings, seed: int) -> dict[str, str]:
    """Name → value or hash of everything that decides the bytes of a bake. The number of threads does not."""
    parts = {"version of rtgi": RTGI_VERSION, "version of numpy": np.__version__, "technique": technique, "seed": str(seed)}
    parts |= {f"setting {item.name}": repr(getattr(settings, item.name)) for item in fields(settings)}
    return parts | {f"{part} of the scene": content_hash(getattr(scene, part)) for part in _SCENE_PARTS}


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
