"""Follow shader links and boil every closure down to what diffuse transport knows: albedo, emission, coverage."""

from dataclasses import dataclass, field, replace
from operator import add

import bpy
import numpy as np

from . import albedo, measured
from .links import follow
from .nodes import NodeReader
from .operations import quotient
from .values import Unreadable, Value, apply

# Light added to a see-through surface (Add Shader of Transparent and Emission) needs something to be emitted from.
GLOW_COVERAGE = 0.05
# And what reflects, varying over the surface, covers so much of what all rays pass.
VARYING_COVERAGE = 0.5
# What Blender's sockets hold when a node is added, where a node lacks one.
_DEFAULT_COLOR, _DEFAULT_ROUGHNESS, _DEFAULT_IOR, _DEFAULT_LEVEL, _DEFAULT_SIZE = 0.8, 0.5, 1.5, 0.5, 0.5
STRAIGHT = ("light passes its glass straight on (refraction and caustics are not followed), and that of lamps without a size not "
            "at all, as in Cycles")
_BLACK, _WHITE = Value.of(0.0), Value.of(1.0)


@dataclass(frozen=True, eq=False)
class Surface:
    """``alpha`` is the share of rays that meet the surface at all; ``albedo``, ``emission`` and ``translucency`` (what it lets
    through diffusely) are those of that share, ``tint`` is the colour of what passes straight on; ``glass`` bounds what bends
    light, and passes only the share ``clear`` of rays unbent (None: all that pass)."""

    albedo: Value = _BLACK
    emission: Value = _BLACK
    alpha: Value = _WHITE
    base_color: Value | None = None
    metallic: Value = _BLACK
    roughness: Value = field(default_factory=lambda: Value.of(1.0))
    specular: Value = _BLACK
    tint: Value = _WHITE
    translucency: Value = _BLACK
    glass: bool = False
    clear: Value | None = None

    @property
    def transparency(self) -> Value:
        """The share of all rays that pass without being bent."""
        return 1.0 - self.alpha if self.clear is None else self.clear


def default_surface() -> Surface:
    """What Cycles gives a mesh without a material: from 5.0 on a Principled BSDF as it is when it is added, gloss included; before,
    a diffuse surface of the same colour."""
    if bpy.app.version < (5, 0):
        return Surface(Value.of(_DEFAULT_COLOR), base_color=Value.of(_DEFAULT_COLOR))
    base, roughness, reflectance = _DEFAULT_COLOR, _DEFAULT_ROUGHNESS, albedo.reflectance_from_ior(_DEFAULT_IOR)
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
        (out, where), _types = follow(socket, path)
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
        roughness, ior = self._number(node, "Roughness", path, _DEFAULT_ROUGHNESS), self._number(node, "IOR", path, _DEFAULT_IOR)
        # A level of a half is what the index of refraction says.
        f0 = albedo.reflectance_from_ior(ior) * 2.0 * self._number(node, "Specular IOR Level", path, _DEFAULT_LEVEL)
        edge = np.maximum(self._mean_color(node, "Specular Tint", path), 0.0)
        normal_reflectance = np.minimum(f0 * edge, 1.0)
        specular = albedo.dielectric_specular(roughness, normal_reflectance)
        # What a layer leaves of what lies under it is grey in Cycles, by the colour that it reflects most of.
        left = 1.0 - float(specular.max())
        multiple = node.distribution == "MULTI_GGX"
        even = self._rough(node, base, self._number(node, "Diffuse Roughness", path))
        self._say_of_gloss(node, path)

        wall = self._number(node, "Thin Wall", path) > 0.5
        through = self._through(node, path) if wall else 0.0
        if not wall and self._number(node, "Subsurface Weight", path) > 0.0:
            self._spread(node, "Subsurface ", path)
        reflected = even * ((1.0 - through) * left) + Value.of(specular)
        translucency = base * (through * left)
        covered, tint = _WHITE, _WHITE
        if not transmission.equals(0.0):
            covered, tint, glass = self._glassy(base, specular, ior, wall)
            covered = 1.0 - transmission * (1.0 - covered) * (1.0 - metallic)
            reflected = reflected * (1.0 - transmission) + transmission * glass
            translucency = translucency * (1.0 - transmission)
        if not metallic.equals(0.0):
            conductor = apply(lambda color: albedo.metal(color, roughness, multiple, edge), base)
            reflected = reflected * (1.0 - metallic) + conductor * metallic
            translucency = translucency * (1.0 - metallic)
        emission = self._input(node, "Emission Color", path) * self._input(node, "Emission Strength", path)
        coat = self._number(node, "Coat Weight", path)
        if coat > 0.0:
            index = self._number(node, "Coat IOR", path, _DEFAULT_IOR)
            f0 = albedo.reflectance_from_ior(index)
            gloss = coat * albedo.dielectric_specular(self._number(node, "Coat Roughness", path), f0)
            stain = albedo.through_coat(np.clip(self._mean_color(node, "Coat Tint", path), 0.0, 1.0), index)
            left = (1.0 - gloss) * (1.0 - coat * (1.0 - stain))
            reflected, emission, translucency = reflected * left + Value.of(gloss), emission * left, translucency * left
            covered = 1.0 - (1.0 - covered) * float(left.mean())
            tint = tint * (left / left.mean())
        weight = self._number(node, "Sheen Weight", path)
        if weight > 0.0:
            cover = np.clip(self._mean_color(node, "Sheen Tint", path), 0.0, 1.0)
            sheen = weight * cover * measured.sheen(self._number(node, "Sheen Roughness", path, _DEFAULT_ROUGHNESS))
            left = 1.0 - float(sheen.max())
            reflected, emission, translucency = reflected * left + Value.of(sheen), emission * left, translucency * left
            covered = 1.0 - (1.0 - covered) * left
        alpha = covered * self._input(node, "Alpha", path, 1.0).clamped()
        if alpha is not covered and not tint.equals(1.0):
            whole = self._input(node, "Alpha", path, 1.0).clamped()
            tint = ratio((1.0 - covered) * tint * whole + (1.0 - whole), 1.0 - alpha)
        return Surface(
            ratio(reflected, covered), ratio(emission, covered), alpha, base, metallic,
            self._preview(node, "Roughness", path, _DEFAULT_ROUGHNESS), Value.of(normal_reflectance).clamped(), tint,
            ratio(translucency, covered), not transmission.equals(0.0),
            None if transmission.equals(0.0) else 1.0 - self._input(node, "Alpha", path, 1.0).clamped())

    def _through(self, node, path: tuple) -> float:
        """Share of what a thin wall scatters that leaves on the other side: half of it, or more the more it scatters forwards."""
        weight = self._number(node, "Subsurface Weight", path)
        return weight * 0.5 * (1.0 + self._number(node, "Subsurface Anisotropy", path))

    def _glassy(self, base: Value, specular: np.ndarray, ior: float, wall: bool) -> tuple[Value, Value, Value]:
        """Coverage of glass of colour ``base`` that reflects ``specular`` (3,) from outside, the tint of what passes, and the
        reflectance of the whole."""
        self._remark(STRAIGHT)
        if wall:
            reflected, passed = (apply(lambda color, way=way: albedo.thin_wall(color, ior)[way], base) for way in (0, 1))
            covered = apply(lambda color: np.repeat(color.max(axis=-1, keepdims=True), 3, axis=-1), reflected)
            return covered, ratio(passed, 1.0 - covered), reflected
        seen = self._of_side(specular, ior)
        return Value.of(float(seen.mean())), apply(lambda color: np.sqrt(np.clip(color, 0.0, 1.0)), base), Value.of(seen)

    def _of_side(self, specular: np.ndarray, ior: float) -> np.ndarray:
        """What glass reflects (3,) to the side that is asked about; the back lies inside it."""
        inside = self._nodes.ray.back if ior >= 1.0 else not self._nodes.ray.back
        return albedo.inside_reflectance(specular, ior) if inside else specular

    def _mean_color(self, node, name: str, path: tuple) -> np.ndarray:
        try:
            return self._input(node, name, path, 1.0).mean()
        except Unreadable:
            return np.ones(3, np.float32)

    def _diffuse(self, node, path: tuple) -> Surface:
        color = self._input(node, "Color", path)
        return Surface(self._rough(node, color, self._number(node, "Roughness", path)), base_color=color)

    def _subsurface(self, node, path: tuple) -> Surface:
        self._spread(node, "", path)
        color = self._input(node, "Color", path)
        return Surface(color, base_color=color)

    def _spread(self, node, prefix: str, path: tuple) -> None:
        """Say how far light goes beneath the surface in Cycles. Its colour is what leaves one that is flat and thick."""
        reach = float(self._mean_color(node, prefix + "Radius", path).max()) * self._number(node, prefix + "Scale", path, 1.0)
        if reach > 0.0:
            self._remark(f"the light that goes some {reach:.2g} m beneath its surface leaves it where it entered")

    def _rough(self, node, color: Value, roughness: float) -> Value:
        """Albedo of rough diffuse reflection of ``color``. Says what bends diffuse reflection in Cycles and not here; the reflected
        flux is right all the same."""
        if node.inputs["Normal"].is_linked:
            self._remark("its bumps are left out")
        if roughness <= 0.0:
            return color
        self._remark("its rough diffuse reflection (Oren-Nayar) is treated as even in all directions")
        try:
            return apply(lambda colors: albedo.rough_diffuse(colors, roughness), color)
        except Unreadable:  # an attribute: as much less as grey loses
            return color * float(2.0 * albedo.rough_diffuse(np.float32(0.5), roughness))

    def _say_of_gloss(self, node, path: tuple) -> None:
        """Say what of a glossy layer's or a metal's reflection is left out."""
        if any(self._number(node, name, path) > 0.0 for name in ("Anisotropic", "Anisotropy")):
            self._remark("its anisotropic reflection is taken as that of even roughness")
        if self._number(node, "Thin Film Thickness", path) > 0.0:
            self._remark("the colours of its thin film are left out")

    def _toon(self, node, path: tuple) -> Surface:
        self._remark("its light and dark are evened out: it reflects as much of even light as in Cycles")
        share = measured.toon(self._number(node, "Size", path, _DEFAULT_SIZE), self._number(node, "Smooth", path))
        color = self._input(node, "Color", path)
        return Surface(color * share, base_color=color)

    def _sheen(self, node, path: tuple) -> Surface:
        color = self._input(node, "Color", path)
        return Surface(color * measured.sheen(self._number(node, "Roughness", path, _DEFAULT_ROUGHNESS), node.distribution),
                       base_color=color)

    def _translucent(self, node, path: tuple) -> Surface:
        color = self._rough(node, self._input(node, "Color", path), 0.0)
        return Surface(base_color=color, translucency=color)

    def _glossy(self, node, path: tuple) -> Surface:
        color, roughness = self._input(node, "Color", path), self._number(node, "Roughness", path, _DEFAULT_ROUGHNESS)
        multiple = node.distribution == "MULTI_GGX"
        self._say_of_gloss(node, path)
        reflected = apply(lambda color: albedo.metal(color, roughness, multiple, None), color)
        return Surface(reflected, base_color=color, metallic=_WHITE,
                       roughness=self._preview(node, "Roughness", path, _DEFAULT_ROUGHNESS))

    def _metallic(self, node, path: tuple) -> Surface:
        self._say_of_gloss(node, path)
        roughness, multiple = self._number(node, "Roughness", path, _DEFAULT_ROUGHNESS), node.distribution == "MULTI_GGX"
        if node.fresnel_type == "PHYSICAL_CONDUCTOR":
            # The complex index n + ik.
            index = self._input(node, "IOR", path), self._input(node, "Extinction", path)
            color = apply(lambda n, k: albedo.conductor_fresnel(n, k, 1.0), *index)
            reflected = apply(lambda n, k: albedo.conductor(n, k, roughness, multiple), *index)
        else:
            color, edge = self._input(node, "Base Color", path), np.clip(self._mean_color(node, "Edge Tint", path), 0.0, 1.0)
            reflected = apply(lambda color: albedo.metal(color, roughness, multiple, edge), color)
        return Surface(reflected, base_color=color, metallic=_WHITE,
                       roughness=self._preview(node, "Roughness", path, _DEFAULT_ROUGHNESS))

    def _glass(self, node, path: tuple) -> Surface:
        color, ior = self._input(node, "Color", path), self._number(node, "IOR", path, _DEFAULT_IOR)
        specular = albedo.dielectric_specular(self._number(node, "Roughness", path), albedo.reflectance_from_ior(ior))
        reflects = node.bl_idname == "ShaderNodeBsdfGlass"
        self._remark(STRAIGHT)
        covered = Value.of(self._of_side(specular if reflects else np.zeros(3, np.float32), ior))
        return Surface(color if reflects else _BLACK, _BLACK, covered, color, tint=color.clamped(), glass=True, clear=_BLACK)

    def _transparent(self, node, path: tuple) -> Surface:
        return Surface(alpha=_BLACK, tint=self._input(node, "Color", path).clamped())

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
    for clear, other, share in ((first, second, factor), (second, first, 1.0 - factor)):
        # Coverage that is cut at a threshold must stay as it is.
        if clear.alpha.equals(0.0) and not _glows(clear) and (other.alpha.equals(1.0) or _clear(clear, other)):
            return replace(other, alpha=share * other.alpha, tint=clear.tint,
                           **_bending((1.0 - share, clear), (share, other)))
    return _weighted((1.0 - factor, first), (factor, second), coverage=add)


def added(first: Surface, second: Surface) -> Surface:
    """Add Shader: reflection, emission and transparency add up."""
    return _weighted((_WHITE, first), (_WHITE, second), coverage=lambda first, second: (first + second - 1.0).clamped())


def _weighted(*weighted: tuple[Value, Surface], coverage) -> Surface:
    """The sum of two surfaces, each with its weight; ``coverage`` makes one of what each covers."""
    surfaces = [surface for _weight, surface in weighted]
    shares = [weight * surface.alpha for weight, surface in weighted]

    def total(name: str) -> Value:
        first, second = (getattr(surface, name) * share for surface, share in zip(surfaces, shares, strict=True))
        return first + second

    alpha = _WHITE if all(surface.alpha.equals(1.0) for surface in surfaces) else coverage(*shares)
    emission, reflected, through = total("emission"), total("albedo"), total("translucency")
    passed = add(*(weight * (1.0 - surface.alpha) * surface.tint for weight, surface in weighted))
    added_to_nothing = alpha.equals(0.0) and not (reflected.equals(0.0) and through.equals(0.0))
    if alpha.equals(0.0):
        alpha = _least_coverage(reflected, through, emission, passed)
    tint = _WHITE if _clear(*surfaces) and not added_to_nothing else ratio(passed, 1.0 - alpha)
    main = next((surface for surface in surfaces if surface.base_color is not None), surfaces[-1])
    return Surface(ratio(reflected, alpha), ratio(emission, alpha), alpha, main.base_color, main.metallic, main.roughness,
                   main.specular, tint, ratio(through, alpha), **_bending(*weighted))


def _least_coverage(reflected: Value, through: Value, emission: Value, passed: Value) -> Value:
    """Coverage of what is added to a surface that all rays pass: something must be there to reflect, or to emit."""
    matter = reflected + through
    if matter.equals(0.0):
        return _BLACK if emission.equals(0.0) else Value.of(GLOW_COVERAGE)
    if not matter.is_constant or not passed.is_constant:
        return Value.of(VARYING_COVERAGE)
    return Value.of(min(max(float(matter.constant.max()), 1.0 - float(passed.constant.max()), GLOW_COVERAGE), 1.0 - GLOW_COVERAGE))


def _bending(*weighted: tuple[Value, Surface]) -> dict:
    """``glass`` and ``clear`` of a sum of surfaces, each with its weight."""
    if not any(surface.glass for _weight, surface in weighted):
        return {}
    clear = sum((weight * surface.transparency for weight, surface in weighted), _BLACK)
    return {"glass": True, "clear": clear.clamped()}


def _clear(*surfaces: Surface) -> bool:
    """Whether what passes any of them keeps its colour."""
    return all(surface.alpha.equals(1.0) or surface.tint.equals(1.0) for surface in surfaces)


def _glows(surface: Surface) -> bool:
    return not surface.emission.equals(0.0)


def ratio(value: Value, alpha: Value) -> Value:
    """``value`` per covered share; 0 where nothing is covered."""
    if alpha.equals(1.0) or value.equals(0.0):
        return value
    if alpha.is_constant:
        return value * (1.0 / float(alpha.constant[0]) if alpha.constant[0] > 0 else 0.0)
    return apply(quotient, value, alpha)


_READERS = {
    "ShaderNodeBsdfPrincipled": ShaderReader._principled,
    "ShaderNodeBsdfDiffuse": ShaderReader._diffuse,
    "ShaderNodeSubsurfaceScattering": ShaderReader._subsurface,
    "ShaderNodeBsdfTranslucent": ShaderReader._translucent,
    "ShaderNodeBsdfAnisotropic": ShaderReader._glossy,
    "ShaderNodeBsdfMetallic": ShaderReader._metallic,
    "ShaderNodeBsdfGlass": ShaderReader._glass,
    "ShaderNodeBsdfRefraction": ShaderReader._glass,
    "ShaderNodeBsdfTransparent": ShaderReader._transparent,
    "ShaderNodeEmission": ShaderReader._emission,
    "ShaderNodeBackground": ShaderReader._emission,
    "ShaderNodeHoldout": ShaderReader._black,
    "ShaderNodeBsdfToon": ShaderReader._toon,
    "ShaderNodeBsdfSheen": ShaderReader._sheen,
    "ShaderNodeBsdfHair": ShaderReader._diffuse,
    "ShaderNodeMixShader": ShaderReader._mix,
    "ShaderNodeAddShader": ShaderReader._add,
}
