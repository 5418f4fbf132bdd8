"""Follow volume shader links and boil every closure down to what a medium does: scattering, absorption, emission, phase function.

The formulas are those of Cycles (``kernel/svm/closure.h``), held to its renders: emission is not multiplied by density; Principled
Volume absorbs (1 − colour)(1 − √absorption colour) of its density, Volume Scatter nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from ...scene import Phase
from ...scene.medium import DRAINE, FOURNIER_FORAND, HENYEY_GREENSTEIN, MIE
from .links import follow
from .nodes import NodeReader, blackbody_color
from .values import Unreadable, Value, apply

# Stefan and Boltzmann's constant over π, in the units in which Cycles scales its blackbody [kW·m⁻²·K⁻⁴·sr⁻¹ a thousandth].
_RADIATED = 5.670373e-8 * 1e-6 / np.pi
# Temperatures [K] between which the colour is interpolated: those that Blender's own table knows.
_KELVIN = np.linspace(800.0, 12000.0, 225)
_BLACK, _WHITE = Value.of(0.0), Value.of(1.0)


@dataclass(frozen=True, eq=False)
class Part:
    """What one closure adds to a medium: σ_s, σ_a [1/m] and emission [W·sr⁻¹·m⁻³] by place, and how it scatters."""

    scattering: Value = _BLACK
    absorption: Value = _BLACK
    emission: Value = _BLACK
    phase: Phase = field(default_factory=Phase)

    def __mul__(self, factor: Value) -> "Part":
        return replace(self, scattering=self.scattering * factor, absorption=self.absorption * factor,
                       emission=self.emission * factor)


class MediumReader:
    """Reads volume shaders through a ``NodeReader``; ``remarks`` are the approximations that were made.

    ``attribute`` gives the value of an attribute that a node names and the object may have (a grid), or None where it has none.
    """

    def __init__(self, nodes: NodeReader, attribute: Callable[[str], Value | None] = lambda _name: None):
        self._nodes, self._attribute = nodes, attribute
        self.remarks: list[str] = []

    def parts(self, socket, path: tuple = ()) -> list[Part]:
        """What feeds a shader input, or an output: one part a closure. Raises Unreadable."""
        (out, where), _types = follow(socket, path) if not socket.is_output else ((socket, path), ())
        if not out.is_output:
            return []
        reader = _READERS.get(out.node.bl_idname)
        if reader is None:
            self._remark(f"{out.node.label or out.node.name} is no volume shader, and is left out")
            return []
        return reader(self, out.node, where)

    def _remark(self, text: str) -> None:
        if text not in self.remarks:
            self.remarks.append(text)

    def _input(self, node, name: str, path: tuple) -> Value:
        return self._nodes.value(node.inputs[name], path)

    def _positive(self, node, name: str, path: tuple) -> Value:
        value = self._input(node, name, path)
        if value.is_constant and np.all(value.constant >= 0):
            return value
        if value.is_constant and np.any(value.constant < 0):
            self._remark(f"{name} of {node.label or node.name} is negative, which counts as 0")
        return apply(lambda x: np.maximum(x, 0.0), value)

    def _number(self, node, name: str, path: tuple) -> float:
        """A parameter that is the same all over a medium: its mean where nodes let it vary."""
        socket = node.inputs.get(name)
        if socket is None:
            return 0.0
        value = self._nodes.value(socket, path)
        if not value.is_constant:
            self._remark(f"{name} of {node.label or node.name} varies, and is taken as its mean")
        return float(value.mean().mean())

    def _phase(self, node, path: tuple) -> Phase:
        kind = getattr(node, "phase", HENYEY_GREENSTEIN)
        names = {HENYEY_GREENSTEIN: ("Anisotropy",), DRAINE: ("Anisotropy", "Alpha"), FOURNIER_FORAND: ("IOR", "Backscatter"),
                 MIE: ("Diameter",)}.get(kind, ())
        limit = 1.0 - 1e-3  # as Cycles limits it
        numbers = {name.lower(): self._number(node, name, path) for name in names}
        if "anisotropy" in numbers:
            numbers["anisotropy"] = float(np.clip(numbers["anisotropy"], -limit, limit))
        return Phase(kind, **numbers)

    def _scatter(self, node, path: tuple) -> list[Part]:
        scattering = self._positive(node, "Color", path) * self._positive(node, "Density", path)
        return [Part(scattering, phase=self._phase(node, path))]

    def _absorption(self, node, path: tuple) -> list[Part]:
        absorbed = apply(lambda x: np.maximum(1.0 - x, 0.0), self._input(node, "Color", path))
        return [Part(absorption=absorbed * self._positive(node, "Density", path))]

    def _coefficients(self, node, path: tuple) -> list[Part]:
        scattering, absorption, emission = (self._positive(node, f"{name} Coefficients", path)
                                            for name in ("Scatter", "Absorption", "Emission"))
        return [Part(scattering, absorption, emission, self._phase(node, path))]

    def _emission(self, node, path: tuple) -> list[Part]:
        return [Part(emission=self._positive(node, "Color", path) * self._positive(node, "Strength", path))]

    def _principled(self, node, path: tuple) -> list[Part]:
        density = self._positive(node, "Density", path)
        named = self._named(node, "Density Attribute", path)
        if named is not None:
            density = density * apply(lambda x: np.maximum(x, 0.0), named)
        color = self._positive(node, "Color", path)
        tint = self._named(node, "Color Attribute", path)
        color = color if tint is None else color * tint
        kept = apply(lambda x: np.sqrt(np.maximum(x, 0.0)), self._input(node, "Absorption Color", path))
        absorbed = apply(lambda a, b: np.maximum(1.0 - a, 0.0) * np.maximum(1.0 - b, 0.0), color, kept)
        emission = self._positive(node, "Emission Strength", path) * self._positive(node, "Emission Color", path)
        heat = self._input(node, "Blackbody Intensity", path)
        if not heat.equals(0.0):
            temperature = self._input(node, "Temperature", path)
            named = self._named(node, "Temperature Attribute", path)
            temperature = temperature if named is None else temperature * named
            emission = emission + apply(blackbody, temperature, heat) * self._positive(node, "Blackbody Tint", path)
            if temperature.is_constant and np.min(_colour(temperature.constant)) <= 0:
                self._remark(f"the blackbody of {node.label or node.name} is redder than colours of the scene can be: what Cycles "
                             "takes of blue or green for it is left out")
        return [Part(color * density, absorbed * density, emission, self._phase(node, path))]

    def _named(self, node, name: str, path: tuple) -> Value | None:
        """The attribute that a text input of Principled Volume names, where the object has it."""
        (socket, _path), _types = follow(node.inputs[name], path)
        text = "" if socket.is_output else socket.default_value
        return self._attribute(text) if text else None

    def _mix(self, node, path: tuple) -> list[Part]:
        factor = self._nodes.value(node.inputs[0], path).clamped()
        shares = ((1.0 - factor, node.inputs[1]), (factor, node.inputs[2]))
        return [part * share for share, socket in shares if not share.equals(0.0) for part in self.parts(socket, path)]

    def _add(self, node, path: tuple) -> list[Part]:
        return self.parts(node.inputs[0], path) + self.parts(node.inputs[1], path)


def merged(parts: list[Part]) -> list[Part]:
    """The same with as few parts as there are phase functions; what does not scatter goes to the first."""
    scattering = [part for part in parts if not part.scattering.equals(0.0)]
    phases = list(dict.fromkeys(part.phase for part in scattering)) or [Phase()]
    found = {phase: Part(phase=phase) for phase in phases}
    for part in parts:
        phase = phases[0] if part.scattering.equals(0.0) else part.phase
        one = found[phase]
        found[phase] = Part(one.scattering + part.scattering, one.absorption + part.absorption, one.emission + part.emission,
                            phase)
    return list(found.values())


def blackbody(kelvin: np.ndarray, intensity: np.ndarray) -> np.ndarray:
    """Emission [W·sr⁻¹·m⁻³] of Principled Volume's blackbody, untinted: σ/π·(1 + (T⁴ − 1)·intensity) times the colour of the
    temperature, both (..., 3) with equal components; no component below 0."""
    kelvin, intensity = np.maximum(kelvin, 0.0)[..., 0], np.asarray(intensity)[..., 0]
    strength = np.where(intensity > 0, _RADIATED * (1.0 + (kelvin**4 - 1.0) * intensity), 0.0)
    return np.maximum(_colour(kelvin) * strength[..., None], 0.0).astype(np.float32)


def _colour(kelvin: np.ndarray) -> np.ndarray:
    """The colour (..., 3) of a body at ``kelvin`` (...): 0 where it is redder than any of the scene and Cycles' is below 0."""
    held = np.clip(kelvin, _KELVIN[0], _KELVIN[-1])
    return np.stack([np.interp(held, _KELVIN, channel) for channel in _colours().T], axis=-1)


@cache
def _colours() -> np.ndarray:
    return np.stack([blackbody_color(kelvin) for kelvin in _KELVIN]).astype(np.float64)


def constant_parts(reader: MediumReader, socket, path: tuple = ()) -> list[Part] | None:
    """``merged`` parts of what feeds ``socket`` if they are the same everywhere, None where they vary or cannot be read so."""
    try:
        parts = merged(reader.parts(socket, path))
    except Unreadable:
        return None
    varies = any(not value.is_constant for part in parts for value in (part.scattering, part.absorption, part.emission))
    return None if varies else parts


_READERS = {
    "ShaderNodeVolumePrincipled": MediumReader._principled,
    "ShaderNodeVolumeScatter": MediumReader._scatter,
    "ShaderNodeVolumeAbsorption": MediumReader._absorption,
    "ShaderNodeVolumeCoefficients": MediumReader._coefficients,
    "ShaderNodeEmission": MediumReader._emission,
    "ShaderNodeMixShader": MediumReader._mix,
    "ShaderNodeAddShader": MediumReader._add,
}
