"""A scene as a JSON-able document and arrays, and back: what lets it travel without the files that it was read from.

Everything that light transport may know is a handful of frozen dataclasses over plain values, so one walk over them writes all.
What several things share (a texture, a material's own back) is written once and shared again afterwards. Reading makes objects of
these classes and of no others.
"""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass

import numpy as np

from ..storage.parse import Refused, anything, listing, quoted, record, table, text
from .lamp_profile import LampProfile
from .lights import AreaLight, PointLight, SpotLight, SunLight
from .linking import Linking
from .material import Channel, Material, Texture
from .medium import ClosedMesh, DensityGrid, Medium, Phase
from .omission import Omission
from .scattered import Scattered
from .scene import Camera, Instance, Mesh, Mist, NearSurfaces, ProbeVolume, Scene, World
from .sphere_probe import SphereProbe

KINDS = {kind.__name__: kind for kind in (
    Scene, Mesh, Instance, World, Mist, ProbeVolume, Camera, Material, Channel, Texture, Linking, Omission, LampProfile, SunLight,
    PointLight, SpotLight, AreaLight, Medium, Phase, ClosedMesh, DensityGrid, SphereProbe,
    NearSurfaces, Scattered)}
# A document as ``encode`` makes it, as a part of another's schema: every object after those that it refers to, so that the last one
# is what was encoded.
ENCODED = record({"objects": listing(record({"kind": text, "fields": table(text, anything)}))})
_NOT_FINITE = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


def encode(value) -> tuple[dict, dict[str, np.ndarray]]:
    """``value``, an object of one of KINDS, as a document and the arrays that it names."""
    encoder = _Encoder()
    encoder.of(value)
    return {"objects": encoder.objects}, encoder.arrays


def decode(document: dict, arrays: Mapping[str, np.ndarray]):
    """What ``encode`` made the ``document`` (which keeps to ENCODED) and ``arrays`` of. Raises Refused where they do not fit."""
    objects = []
    for number, entry in enumerate(document["objects"]):
        where = f"objects[{number}]"
        kind = KINDS.get(entry["kind"])
        if kind is None:
            raise Refused(f"{where} is of the unknown kind {quoted(entry['kind'])}")
        known = [item.name for item in fields(kind)]
        if sorted(entry["fields"]) != sorted(known):
            raise Refused(f"{where} has other fields than {entry['kind']} has")
        values = entry["fields"].items()
        objects.append(kind(**{name: _decoded(value, objects, arrays, f"{where}.{name}") for name, value in values}))
    if not objects:
        raise Refused("it holds no object")
    return objects[-1]


class _Encoder:
    def __init__(self):
        self.objects, self.arrays = [], {}
        # By identity, with the value itself, so that no other takes its place in memory meanwhile.
        self._known: dict[int, tuple[object, dict]] = {}

    def of(self, value):
        """The JSON that stands for ``value``."""
        if value is None or isinstance(value, (bool, str)):
            return value
        if isinstance(value, np.generic):
            value = np.asarray(value)
        elif isinstance(value, int):
            return value
        elif isinstance(value, float):
            return value if math.isfinite(value) else {"float": repr(value)}
        elif isinstance(value, (tuple, list)):
            return {"tuple" if isinstance(value, tuple) else "list": [self.of(item) for item in value]}
        elif isinstance(value, dict):
            return {"pairs": [[self.of(key), self.of(item)] for key, item in value.items()]}
        if id(value) not in self._known:
            self._known[id(value)] = value, self._shared(value)
        return self._known[id(value)][1]

    def _shared(self, value) -> dict:
        if isinstance(value, np.ndarray):
            name = str(len(self.arrays))
            self.arrays[name] = value
            return {"array": name}
        kind = type(value).__name__
        if not is_dataclass(value) or KINDS.get(kind) is not type(value):
            raise TypeError(f"{type(value)} is nothing that a scene is made of")
        written = {item.name: self.of(getattr(value, item.name)) for item in fields(value)}
        self.objects.append({"kind": kind, "fields": written})
        return {"object": len(self.objects) - 1}


def _decoded(value, objects: list, arrays: Mapping[str, np.ndarray], where: str):
    if not isinstance(value, dict):
        if isinstance(value, list):
            raise Refused(f"{where} is a bare list")
        return value
    if len(value) != 1:
        raise Refused(f"{where} has {len(value)} entries instead of one")
    (kind, content), = value.items()
    if kind == "object" and type(content) is int and 0 <= content < len(objects):
        return objects[content]
    if kind == "array" and isinstance(content, str) and content in arrays:
        return arrays[content]
    if kind == "float" and isinstance(content, str) and content in _NOT_FINITE:
        return _NOT_FINITE[content]
    if kind in ("tuple", "list") and isinstance(content, list):
        items = [_decoded(item, objects, arrays, where) for item in content]
        return tuple(items) if kind == "tuple" else items
    if kind == "pairs" and isinstance(content, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in content):
        pairs = [[_decoded(item, objects, arrays, where) for item in pair] for pair in content]
        if all(isinstance(key, (str, int)) for key, _ in pairs):
            return dict(pairs)
    raise Refused(f"{where} is {quoted(value)}, which stands for nothing")
