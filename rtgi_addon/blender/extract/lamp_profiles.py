"""Lamps with what their nodes make of their light, asked of Cycles where that is no constant."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from ...scene import Light, Omissions
from ..fingerprint import node_digest
from ..materials.circumstances import PLACEMENT, questions
from ..remembered import answer, remembers
from .lamp_nodes import node_factor
from .lamp_rig import POWER, LampSource
from .lamp_tables import Measured, measure
from .lamps import plain_lamp

# Settings of a lamp that its nodes may see, or that shape where it shines.
_SETTINGS = ("spot_size", "spot_blend", "shape", "size", "size_y", "spread", "shadow_soft_size", "use_soft_falloff", "angle")
# A share of its light by which a lamp may be off without a word.
_UNSAID = 0.03


@dataclass(frozen=True, eq=False)
class LampRequest:
    """What to ask of Cycles: ``source`` as it is asked, in the lamp's own axes unless its nodes look at where it stands, and the
    ``rotation`` (3, 3) of the lamp in the world; ``key`` tells it from others."""

    source: LampSource
    rotation: np.ndarray
    key: str


def request_of(obj, matrix_world, frame_number: tuple[int, float]) -> LampRequest | None:
    """What to ask about the nodes of an evaluated LIGHT object under ``matrix_world``; None where they are a constant, which
    `lamps.read_lamp` has read."""
    lamp = obj.data
    if node_factor(lamp) is not None:
        return None
    matrix = np.array(matrix_world, np.float64)
    settings = {name: getattr(lamp, name) for name in _SETTINGS if hasattr(lamp, name)}
    source = LampSource(obj.name, lamp.type, lamp.original, settings, matrix, obj.pass_index, tuple(obj.color), frame_number)
    rotation = source.rotation
    if not _looks_around(lamp):
        own = np.eye(4)
        own[:3, :3] = rotation.T @ matrix[:3, :3]
        source = replace(source, world_from_local=own)
    # Evaluating a scene twice may differ in the last digits; and there is but one zero.
    placed = np.round(source.world_from_local, 5) + 0.0
    asked = repr((lamp.type, settings, source.index, source.color, placed.tolist()))
    return LampRequest(source, rotation, node_digest(lamp) + asked)


def is_answered(request: LampRequest) -> bool:
    """Whether Cycles need not be asked while what it said is used again (see `remembered`)."""
    return remembers(request.key)


def with_profile(light: Light, request: LampRequest, omissions: Omissions) -> Light | None:
    """``light`` with the profile that Cycles finds; None where its nodes make nothing of it. What they mix, so that tables do not
    follow it, is added to ``omissions``. Raises BakeError where Cycles cannot render."""
    found = answer(lambda: request.key, lambda: _measured(request))
    if not np.any(found.factor > 0):
        return None
    if found.error > _UNSAID:
        omissions.add(f"lamp '{light.name}': its nodes mix direction, place and distance, and are followed as a product, up to "
                      f"{found.error:.0%} of its light off", objects=(light.name,))
    strength = (np.asarray(getattr(light, light.STRENGTH), np.float64) * found.factor).astype(np.float32)
    profile = None if found.profile is None else replace(found.profile, world_from_profile=request.rotation)
    return replace(light, **{light.STRENGTH: strength}, profile=profile)


def _measured(request: LampRequest) -> Measured:
    source = request.source
    lamp = SimpleNamespace(type=source.kind, normalize=True, use_shadow=False, **source.settings)
    return measure(source, plain_lamp(source.name, lamp, source.world_from_local, np.full(3, POWER)))


def _looks_around(lamp) -> bool:
    """Whether a lamp's nodes may answer differently where it stands otherwise."""
    output = lamp.node_tree.get_output_node("CYCLES")
    return any(question[0] in PLACEMENT | {"camera"} for question in questions(output.inputs["Surface"]))
