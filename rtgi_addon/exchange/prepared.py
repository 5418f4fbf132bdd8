"""A bake that travels (docs/formats.md): what all of its probes have in common, and the parts that other machines make of it.

```
PREP/prepared.json  the scene, the technique and its settings, in how many blocks, and what a bundle is to say of all that
PREP/scene.bin      the scene's arrays
PREP/common.bin     where probes stand, and the surface cache
PREP/truth.bin      light at some points on surfaces, that the finished field is held to

PART/part.json      which blocks of which PREP, and what the bundle is to say
PART/blocks.bin     what these blocks hold
PART/about.bin      arrays of what the bundle is to say: media, and which probes are wanted
PART/scene.bin      in its place, in the first part, all of the scene where sphere probes are baked once the rest stands
PART/truth.bin      as of PREP
```

Neither needs Blender, the .blend or a texture.
"""

from dataclasses import replace

import numpy as np

from .. import kernels
from ..errors import BakeError
from ..kernels.library import VERSION as KERNELS_VERSION
from ..scene import Scene, World
from ..scene.encoding import ENCODED, decode, encode
from ..storage.parse import Refused, anything, digest, listing, one_of, record, table, text, whole
from .array_folder import ArrayFolder, Kind, is_folder, read_folder
from .roles import LAMP_ROLES
from .schema import RTGI_VERSION

SCENE, COMMON, TRUTH, BLOCKS, ABOUT = "scene.bin", "common.bin", "truth.bin", "blocks.bin", "about.bin"
# What a bundle says of its scene beside what its probes hold.
_SAID = record({"lamps": table(text, one_of(*LAMP_ROLES)), "objects": table(text, one_of("dynamic")), "notes": listing(text),
                "warnings": listing(text), "not_followed": listing(table(text, anything)),
                "direct_lamps": listing(text)})
_ENTRIES = {"rtgi": text, "numpy": text, "technique": text, "settings": table(text, anything), "seed": whole(0),
            "blocks": whole(1), "scene": ENCODED, "said": _SAID, "spheres": table(text, anything)}
PREPARED = Kind("prepared.json", "rtgi-prepared/1", "a prepared bake", "prepare it again (`rtgi FILE prepare --out`)", _ENTRIES)
PART = Kind("part.json", "rtgi-bake-part/1", "a part of a bake", "bake that part again", {
    **_ENTRIES, "prepared": digest, "part": whole(1), "parts": whole(1), "kernels": text, "made": listing(whole(0)),
    "stats": table(text, anything)})


def versions() -> dict[str, str]:
    """What decides the bytes of a bake beside what was prepared."""
    return {"rtgi": RTGI_VERSION, "numpy": np.__version__}


def kernels_here() -> str:
    """Which compiled kernels make a part's bytes here: theirs and numpy's differ by rounding."""
    return str(KERNELS_VERSION) if kernels.is_available() else "none"


def is_prepared(path) -> bool:
    """Whether a prepared bake seems to be at ``path``."""
    return is_folder(PREPARED, path)


def read_prepared(path) -> ArrayFolder:
    """The prepared bake at ``path``. Raises BakeError as ``read_folder``, and for one that another version made."""
    folder = read_folder(PREPARED, path)
    _require_version(folder)
    return folder


def read_part(path) -> ArrayFolder:
    """The part of a bake at ``path``. Raises BakeError as ``read_folder``, and for one that another version made."""
    folder = read_folder(PART, path)
    _require_version(folder)
    return folder


def scene_of(folder: ArrayFolder) -> Scene:
    """The scene of a prepared bake; of a part, what of it a bundle says (``told``). Raises BakeError for a document that does not
    fit its arrays."""
    name = SCENE if SCENE in folder.arrays else ABOUT
    try:
        scene = decode(folder.document["scene"], folder.arrays.get(name, {}))
    except (Refused, TypeError, ValueError) as error:
        raise BakeError(f"{folder.path} is damaged, {error}", PREPARED.remedy) from error
    if not isinstance(scene, Scene):
        raise BakeError(f"{folder.path} is damaged, it holds no scene", PREPARED.remedy)
    return scene


def told(scene: Scene) -> tuple[dict, dict[str, np.ndarray]]:
    """What of ``scene`` a bundle says, as a document and arrays: its volumes and media, without surfaces and light."""
    return encode(replace(scene, meshes=(), instances=(), materials=(), lights=(), world=World.constant(0.0), cameras=(),
                          omissions=(), spheres=()))


def _require_version(folder: ArrayFolder) -> None:
    for name, now in versions().items():
        made = folder.document[name]
        if made != now:
            raise BakeError(f"{folder.path} was made with {name} {made}, and this is {name} {now}: bytes might differ",
                            f"use {name} {made} on every machine, or prepare it again")
