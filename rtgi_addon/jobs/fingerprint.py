"""What a bake depends on, as hashes: a checkpoint is continued only if every one of them is the same."""

from dataclasses import fields

import numpy as np

from ..exchange.schema import RTGI_VERSION
from ..scene import Scene
from ..scene.content import content_hash

# What every technique may read. Cameras, notes and where the file lies change no probe.
_SCENE_PARTS = ("meshes", "instances", "materials", "lights", "world", "volumes", "media")


def fingerprint(scene: Scene, technique: str, settings, seed: int) -> dict[str, str]:
    """Name → value or hash of everything that decides the bytes of a bake. The number of threads does not."""
    parts = {"version of rtgi": RTGI_VERSION, "version of numpy": np.__version__, "technique": technique, "seed": str(seed)}
    parts |= {f"setting {item.name}": repr(getattr(settings, item.name)) for item in fields(settings)}
    return parts | _scene_parts(scene)


def measured_on(scene: Scene | None, wanted: dict) -> dict[str, str]:
    """As ``fingerprint``, of measurements on ``scene`` (None: on none of the user's) that are made as ``wanted`` says (name →
    value)."""
    parts = {"version of rtgi": RTGI_VERSION, "version of numpy": np.__version__}
    return parts | {name: str(value) for name, value in wanted.items()} | ({} if scene is None else _scene_parts(scene))


def _scene_parts(scene: Scene) -> dict[str, str]:
    return {f"{part} of the scene": content_hash(getattr(scene, part)) for part in _SCENE_PARTS}
