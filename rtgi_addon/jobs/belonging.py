"""Whether a bundle is of a scene: nobody is helped by another scene's light in a picture or a game."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import BakeError
from ..exchange.schema import read_manifest
from ..scene import Scene
from ..techniques import Field

# How far apart the entries of two transforms of the same volume may be: files keep single precision.
_SAME = 1e-4


class Box(NamedTuple):
    """A volume as it stands in a scene: ``fitted`` ones have no name of their own."""

    name: str
    world_from_local: np.ndarray
    fitted: bool = False


def about_scene(scene: Scene, field: Field, state: str) -> dict:
    """What of ``scene`` a bundle of ``field`` is found by later, for its statistics: the file's name, ``state`` (a digest that
    Blender made of it, "" for none); and how many probes lie in the open."""
    return {"file": Path(scene.source).name if scene.source else "", "state": state,
            "usable": int(sum(np.count_nonzero(grid.usable) for grid in field.grids()))}


def other_scene(manifest: dict, scene: str, file: str, boxes: Iterable[Box] | None) -> str:
    """Of which other scene a bundle with ``manifest`` is, as words for an error; "" where it may be one of the ``scene`` of that
    name in the ``file`` (its name) with the volumes ``boxes`` (None: not known).

    A scene or a file may be renamed, a volume moved, and the bundle is out of date then, but still of it: it is another's if the
    scene's name is, or if the file's name is and none of the volumes stands where one of the bundle's does.
    """
    if manifest["scene"] != scene:
        return f"scene {manifest['scene']!r}"
    baked = manifest["stats"].get("file", "")
    if not baked or not file or baked == file:
        return ""
    for entry in manifest["volumes"]:
        for box in boxes or ():
            same_name = entry["name"] == box.name or (entry.get("fitted", False) and box.fitted)
            if same_name and np.allclose(entry["world_from_local"], box.world_from_local, rtol=_SAME, atol=_SAME):
                return ""
    return f"another file, {baked}"


def require_of_scene(bundle, scene: Scene) -> None:
    """Raise BakeError if the bundle at path ``bundle`` is another scene's than ``scene``, or cannot be read."""
    boxes = [Box(volume.name, volume.world_from_local, volume.fitted) for volume in scene.volumes]
    other = other_scene(read_manifest(bundle), scene.name, Path(scene.source).name if scene.source else "", boxes)
    if other:
        raise BakeError(f"the bundle {bundle} is of {other}, and not of scene {scene.name!r}",
                        "bake this scene, or give its bundle")
