"""Follow shader links and boil every closure down to what diffuse transport knows: albedo, emission, coverage."""

from dataclasses import dataclass, field, replace

import numpy as np

from . import albedo
from .nodes import NodeReader, quotient
from .values import LUMINANCE, Unreadable, Value, apply

# Light added to a see-through surface (Add Shader of Transparent and Emission) needs something to be emitted from.
GLOW_COVERAGE = 0.05
_BLACK, _WHITE = Value.of(0.0), Value.of(1.0)


@dataclass(frozen=True, eq=False)
class Surface:
    """``alpha`` is the share of rays that meet the surface at all; ``albedo`` and ``emission`` are those of that share."""

    albedo: Value = _BLACK
    emission: Value = _BLACK
    alpha: Value = _WHITE
    base_color: Value | None = None
    metallic: Value = _BLACK
    roughness: Value = field(default_factory=lambda: Value.of(1.0))
    specular: Value = _BLACK


def default_surface() -> Surface:
    """What Cycles from 5.0 on gives a mesh without a material: a Principled BSDF as it is when it is added, gloss included."""
    base, roughness, reflectance = 0.8, 0.5, albedo.reflectance_from_ior(1.5)
    specular = albedo.dielectric_specular(roughness, reflectance)
    return Surface(Value.of(base * (1.0 - specular) + specular), base_color=Value.of(base), roughness=Value.of(roughness),
                   specular=Value.of(reflectance))


class ShaderReader:
    """Reads the surface of one material through a ``NodeReader``; ``remarks`` are the approximations that were made."""

    def __init__(self, nodes: NodeReader):
        self._nodes = nodes
        self.remarks: list[str] = []

    def surface(self, material) -> Surface:
        """What the active Cycles output shows. Raises Unreadable."""
        output = material.node_tree.get_output_node("CYCLES")
        if output is None:
            return Surface()
        if not output.inputs["Surface"].is_linked:
            return Surface(alpha=_BLACK if output.inputs["Volume"].is_linked else _WHITE)
        return self.shader(output.inputs["Surface"], ())

    def shader(self, socket, path: tuple) -> Surface:
        """The closure that feeds a shader input; nothing linked is black, as in Cycles."""
        (out, where), _types = self._nodes.follow(socket, path)
        if not out.is_output:
            return Surface()
        reader = _READERS.get(out.node.bl_idname)
        return self.unknown(out, where) if reader is None else reader(self, out.node, where)

    def unknown(self, out, path: tuple) -> Surface:
        """A closure without a formula here."""
        raise Unreadable(out.node.label or out.node.name, f"{out.node.bl_label} shader")

    def _input(self, node, name: str, path: tuple, default: float = 0.0) -> Value:
        socket = node.inputs.get(name)
        return Value.of(default) if socket is None else self._nodes.value(socket, path)

    def _number(self, node, name: str, path: tuple, default: float = 0.0) -> float:
        """A parameter that enters formulas only by its mean over the surface."""
        try:
            return float(self._input(node, name, path, default).mean().mean())
        except Unreadable:
            return default

    def _preview(self, node, name: str, path: tuple, default: float) -> Value:
        """An input that only the preview shows: never worth a bake of its own."""
        try:
            return self._input(node, name, path, default).clamped()
        except Unreadable:
            return Value.of(default)

    def _remark(self, text: str) -> None:
        if text not in self.remarks:
            self.remarks.append(text)

    def _principled(self, node, path: tuple) -> Surface:
        base = self._input(node, "Base Color", path)
        metallic = self._input(node, "Metallic", path).clamped()
        transmission = self._input(node, "Transmission Weight", path).clamped()
        roughness = self._number(node, "Roughness", path, 0.5)
        level = 2.0 * self._number(node, "Specular IOR Level", path, 0.5)
        f0 = albedo.reflectance_from_ior(self._number(node, "IOR", path, 1.5)) * level
        normal_reflectance = f0 * np.clip(self._tint(node, path), 0.0, 1.0)
        specular = albedo.dielectric_specular(roughness, normal_reflectance)
        multiple = node.distribution == "MULTI_GGX"
        if self._number(node, "Sheen Weight", path) > 0.0:
            self._remark("its sheen is left out")
        self._shape_of_reflection(node, self._number(node, "Diffuse Roughness", path))

        reflected = base * (1.0 - specular) + Value.of(specular)
        passed = _BLACK
        if not transmission.equals(0.0):
            self._remark("rays pass straight through it, uncoloured, where it transmits")
            passed = transmission * apply(lambda b, s: _grey(np.sqrt(np.maximum(b, 0.0)) * (1.0 - s)), base, Value.of(specular))
            reflected = reflected * (1.0 - transmission) + transmission * Value.of(specular)
        if not metallic.equals(0.0):
            conductor = apply(lambda b: albedo.metal(b, roughness, multiple), base)
            reflected = reflected * (1.0 - metallic) + conductor * metallic
            passed = passed * (1.0 - metallic)
        emission = self._input(node, "Emission Color", path) * self._input(node, "Emission Strength", path)
        coat = self._number(node, "Coat Weight", path)
        if coat > 0.0:
            f0 = albedo.reflectance_from_ior(self._number(node, "Coat IOR", path, 1.5))
            gloss = coat * albedo.dielectric_specular(self._number(node, "Coat Roughness", path), f0)
            reflected, emission = reflected * (1.0 - gloss) + Value.of(gloss), emission * (1.0 - gloss)
        covered = 1.0 - passed
        return Surface(
            _ratio(reflected, covered), _ratio(emission, covered), covered * self._input(node, "Alpha", path, 1.0).clamped(),
            base, metallic, self._preview(node, "Roughness", path, 0.5), Value.of(normal_reflectance).clamped())

    def _tint(self, node, path: tuple) -> np.ndarray:
        try:
            return self._input(node, "Specular Tint", path, 1.0).mean()
        except Unreadable:
            return np.ones(3, np.float32)

    def _diffuse(self, node, path: tuple) -> Surface:
        color = self._input(node, "Color", path)
        if node.bl_idname == "ShaderNodeBsdfDiffuse":
            self._shape_of_reflection(node, self._number(node, "Roughness", path))
        return Surface(color, base_color=color)

    def _shape_of_reflection(self, node, roughness: float) -> None:
        """Say what bends diffuse reflection in Cycles and not here; the reflected flux is right all the same."""
        if roughness > 0.0:
            self._remark("its rough diffuse reflection (Oren-Nayar) is treated as even in all directions")
        if node.inputs["Normal"].is_linked:
            self._remark("its bumps are left out")

    def _translucent(self, node, path: tuple) -> Surface:
        self._remark("its translucency is treated as reflection")
        return self._diffuse(node, path)

    def _glossy(self, node, path: tuple) -> Surface:
        color, roughness = self._input(node, "Color", path), self._number(node, "Roughness", path, 0.5)
        multiple = node.distribution == "MULTI_GGX"
        reflected = apply(lambda c: albedo.metal(c, roughness, multiple, edge=False), color)
        return Surface(reflected, base_color=color, metallic=_WHITE,
                       roughness=self._preview(node, "Roughness", path, 0.5))

    def _metallic(self, node, path: tuple) -> Surface:
        if node.fresnel_type == "PHYSICAL_CONDUCTOR":
            n, k = self._input(node, "IOR", path), self._input(node, "Extinction", path)
            color = apply(lambda n, k: ((n - 1) ** 2 + k**2) / np.maximum((n + 1) ** 2 + k**2, 1e-9), n, k)
        else:
            color = self._input(node, "Base Color", path)
        roughness, multiple = self._number(node, "Roughness", path, 0.5), node.distribution == "MULTI_GGX"
        return Surface(apply(lambda c: albedo.metal(c, roughness, multiple), color), base_color=color, metallic=_WHITE,
                       roughness=self._preview(node, "Roughness", path, 0.5))

    def _glass(self, node, path: tuple) -> Surface:
        self._remark("rays pass straight through it, uncoloured, where it transmits")
        color = self._input(node, "Color", path)
        f0 = albedo.reflectance_from_ior(self._number(node, "IOR", path, 1.5))
        specular = albedo.dielectric_specular(self._number(node, "Roughness", path), f0)
        specular = specular if node.bl_idname == "ShaderNodeBsdfGlass" else np.zeros(3, np.float32)
        covered = 1.0 - apply(lambda c: _grey(c * (1.0 - specular)), color)
        return Surface(_ratio(color * Value.of(specular), covered), _BLACK, covered, color)

    def _transparent(self, node, path: tuple) -> Surface:
        color = self._input(node, "Color", path)
        if not (color.is_constant and np.ptp(color.constant) < 1e-6):
            self._remark("what it lets through is not coloured")
        return Surface(alpha=1.0 - color.luminance())

    def _emission(self, node, path: tuple) -> Surface:
        return Surface(emission=self._input(node, "Color", path) * self._input(node, "Strength", path))

    def _mix(self, node, path: tuple) -> Surface:
        factor = self._nodes.value(node.inputs[0], path).clamped()
        if factor.equals(0.0) or factor.equals(1.0):
            return self.shader(node.inputs[2 if factor.equals(1.0) else 1], path)
        return mixed(factor, self.shader(node.inputs[1], path), self.shader(node.inputs[2], path))

    def _add(self, node, path: tuple) -> Surface:
        return added(self.shader(node.inputs[0], path), self.shader(node.inputs[1], path))

    def _black(self, _node, _path: tuple) -> Surface:
        return Surface()


def mixed(factor: Value, first: Surface, second: Surface) -> Surface:
    """Mix Shader: ``second`` by ``factor``."""
    if first.alpha.equals(0.0) and not _glows(first):
        return _covering(second, factor * second.alpha)
    if second.alpha.equals(0.0) and not _glows(second):
        return _covering(first, (1.0 - factor) * first.alpha)
    return _weighted(1.0 - factor, first, factor, second, lambda a, b: a + b)


def added(first: Surface, second: Surface) -> Surface:
    """Add Shader: reflection, emission and transparency add up."""
    return _weighted(_WHITE, first, _WHITE, second, lambda a, b: (a + b - 1.0).clamped())


def _weighted(weight_a: Value, a: Surface, weight_b: Value, b: Surface, coverage) -> Surface:
    share_a, share_b = weight_a * a.alpha, weight_b * b.alpha
    alpha = _WHITE if a.alpha.equals(1.0) and b.alpha.equals(1.0) else coverage(share_a, share_b)
    emission = a.emission * share_a + b.emission * share_b
    if alpha.equals(0.0) and not emission.equals(0.0):
        alpha = Value.of(GLOW_COVERAGE)
    main = a if a.base_color is not None else b
    return Surface(_ratio(a.albedo * share_a + b.albedo * share_b, alpha), _ratio(emission, alpha), alpha,
                   main.base_color, main.metallic, main.roughness, main.specular)


def _covering(surface: Surface, alpha: Value) -> Surface:
    return replace(surface, alpha=alpha)


def _glows(surface: Surface) -> bool:
    return not surface.emission.equals(0.0)


def _grey(color: np.ndarray) -> np.ndarray:
    return np.repeat(color @ LUMINANCE, 3).reshape(color.shape)


def _ratio(value: Value, alpha: Value) -> Value:
    """``value`` per covered share; 0 where nothing is covered."""
    if alpha.equals(1.0) or value.equals(0.0):
        return value
    if alpha.is_constant:
        return value * (1.0 / float(alpha.constant[0]) if alpha.constant[0] > 0 else 0.0)
    return apply(quotient, value, alpha)


_READERS = {
    "ShaderNodeBsdfPrincipled": ShaderReader._principled,
    "ShaderNodeBsdfDiffuse": ShaderReader._diffuse,
    "ShaderNodeSubsurfaceScattering": ShaderReader._diffuse,
    "ShaderNodeBsdfTranslucent": ShaderReader._translucent,
    "ShaderNodeBsdfAnisotropic": ShaderReader._glossy,
    "ShaderNodeBsdfMetallic": ShaderReader._metallic,
    "ShaderNodeBsdfGlass": ShaderReader._glass,
    "ShaderNodeBsdfRefraction": ShaderReader._glass,
    "ShaderNodeBsdfTransparent": ShaderReader._transparent,
    "ShaderNodeEmission": ShaderReader._emission,
    "ShaderNodeBackground": ShaderReader._emission,
    "ShaderNodeHoldout": ShaderReader._black,
    "ShaderNodeMixShader": ShaderReader._mix,
    "ShaderNodeAddShader": ShaderReader._add,
}
