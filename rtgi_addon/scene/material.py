"""What a surface reflects, emits and lets through, as plain arrays that know nothing of Blender's nodes."""

from dataclasses import dataclass, field, replace

import numpy as np

# Metadata of fields that change how pictures are drawn, and no light: what was baked without looking at them stays good.
LOOK = {"look": True}


@dataclass(frozen=True, eq=False)
class Texture:
    """An image sampled by UV.

    ``pixels`` is (height, width, channels) with row 0 at v = 0 (Blender's bottom-up order), channels 1, 3 or 4, dtype uint8,
    float16 or float32. ``srgb`` says that RGB is sRGB-encoded (alpha never is) and with it how texels are filtered; this is the
    one place that says which images are which:

    - filtered coded, the result decoded: 8-bit images whose file is sRGB, as Cycles filters them, and what was computed from
      such images alone;
    - filtered linear: everything else. Float images, 8-bit data, and whatever Cycles computed (its values are light already).
    ``extension`` is 'REPEAT', 'EXTEND', 'CLIP' or 'MIRROR'; ``interpolation`` is 'Linear' or 'Closest': Blender's own words.
    """

    name: str
    pixels: np.ndarray
    srgb: bool = False
    extension: str = "REPEAT"
    interpolation: str = "Linear"


@dataclass(frozen=True, eq=False)
class Channel:
    """One material input: ``constant`` × texture(uv) × attribute, each factor optional.

    ``constant`` is (3,) scene-linear (scalars repeat their value). ``uv_layer`` names the mesh's UV map (None = the one active
    for render); ``uv_transform`` is the (2, 3) affine map applied to (u, v, 1) first. ``texture_channel`` is 'rgb' or one of
    'r', 'g', 'b', 'a', which reads a single component. ``attribute`` names a corner attribute of the mesh (vertex colours, or
    the result of the Cycles fallback bake), scene-linear. ``offset`` (3,) is added last: constant·texture·attribute + offset.
    """

    constant: np.ndarray = field(default_factory=lambda: np.ones(3, np.float32))
    texture: Texture | None = None
    texture_channel: str = "rgb"
    uv_layer: str | None = None
    uv_transform: np.ndarray | None = None
    attribute: str | None = None
    offset: np.ndarray | None = None

    @property
    def is_constant(self) -> bool:
        """True if the value is the same everywhere on the surface."""
        return self.texture is None and self.attribute is None

    @property
    def may_be_positive(self) -> bool:
        """False if its constants alone keep it from being positive anywhere."""
        return bool(np.any(self.constant > 0) or (self.offset is not None and np.any(np.asarray(self.offset) > 0)))

    def scaled(self, factor: float) -> "Channel":
        """``factor`` times the value."""
        offset = None if self.offset is None else np.asarray(self.offset, np.float32) * np.float32(factor)
        return replace(self, constant=self.constant * np.float32(factor), offset=offset)

    @staticmethod
    def of(value) -> "Channel":
        """A constant channel from a scalar or an RGB triple."""
        return Channel(np.broadcast_to(np.asarray(value, np.float32), (3,)).copy())


@dataclass(frozen=True, eq=False)
class Material:
    """A surface's inputs.

    ``albedo`` is the hemispherical reflectance that a diffuse transport uses (already reduced by metallic and extended by
    what a specular lobe reflects: the extraction's docstring says how); ``base_color``, ``metallic``, ``roughness`` and
    ``specular`` (what the dielectric layer reflects at normal incidence) are kept for the preview. ``emission`` is radiance
    [W·sr⁻¹·m⁻²], from both faces as in Cycles. ``alpha`` is coverage: ``alpha_threshold`` None means a ray passes with
    probability 1 − alpha, a number means a hard cut at it.
    What passes is multiplied by ``tint``. Of the light that arrives on a side and is covered the share ``translucency`` leaves
    diffusely from the other. ``glass`` says that the surface bounds what bends light: its ``back`` is met from within, but by rays
    that came in through a front it is met as the front is. ``point_alpha`` is the coverage that the light of lamps without a size
    meets (None: the same): nothing finds such a lamp through glass, in Cycles as here.
    ``backface_culling`` is the user's statement that the surface is seen from its front only; light transport is two-sided
    all the same, as in Cycles. ``extraction`` says how it was read: 'nodes' or 'cycles-bake'.

    All this is what diffuse light meets on the mesh's front. ``back`` is what it meets on the other side, ``shadow_alpha`` and
    ``shadow_tint`` what rays towards a light meet, ``camera`` what a camera sees; None where it is the same. Neither ``back`` nor
    ``camera`` has a ``camera`` of its own. ``albedo_by_angle`` and ``emission_by_angle`` (n, 3): ``albedo`` and
    ``emission`` are means over the cosine-weighted hemisphere, and this times them is what leaves under each angle, in n equal
    steps of the squared cosine from grazing upwards (None: evenly). ``line_color`` (RGB, opacity) and ``pass_index`` are for
    styles.
    """

    name: str
    albedo: Channel = field(default_factory=lambda: Channel.of(0.8))
    emission: Channel = field(default_factory=lambda: Channel.of(0.0))
    alpha: Channel = field(default_factory=lambda: Channel.of(1.0))
    alpha_threshold: float | None = None
    base_color: Channel = field(default_factory=lambda: Channel.of(0.8))
    metallic: Channel = field(default_factory=lambda: Channel.of(0.0))
    roughness: Channel = field(default_factory=lambda: Channel.of(0.5))
    backface_culling: bool = False
    extraction: str = "nodes"
    specular: Channel = field(default_factory=lambda: Channel.of(0.0))
    tint: Channel = field(default_factory=lambda: Channel.of(1.0))
    translucency: Channel = field(default_factory=lambda: Channel.of(0.0))
    glass: bool = False
    point_alpha: Channel | None = None
    back: "Material | None" = None
    shadow_alpha: Channel | None = None
    shadow_tint: Channel | None = None
    camera: "Material | None" = None
    albedo_by_angle: np.ndarray | None = None
    emission_by_angle: np.ndarray | None = None
    line_color: tuple[float, float, float, float] = field(default=(0.0, 0.0, 0.0, 1.0), metadata=LOOK)
    pass_index: int = field(default=0, metadata=LOOK)

    def channels(self) -> "list[Channel]":
        """Every input, those of its other answers included."""
        own = [self.albedo, self.emission, self.alpha, self.base_color, self.metallic, self.roughness, self.specular]
        own += [self.tint, self.translucency]
        own += [channel for channel in (self.shadow_alpha, self.shadow_tint, self.point_alpha) if channel is not None]
        return own + [channel for other in (self.back, self.camera) if other is not None for channel in other.channels()]

    @property
    def met_by_light(self) -> "Material":
        """The material with the coverage and the tint that rays towards a light meet; itself where those are the same."""
        back = None if self.back is None else self.back.met_by_light
        if self.shadow_alpha is None:
            return self if back is self.back else replace(self, back=back)
        return replace(self, alpha=self.shadow_alpha, alpha_threshold=None, tint=self.shadow_tint or self.tint, shadow_alpha=None,
                       shadow_tint=None, back=back)

    @property
    def as_drawn(self) -> "Material":
        """The material as a picture of surfaces shows it, that are there or not and reflect: what a tint takes out of light counts
        as covered by black, what passes diffusely as reflected; itself where there is neither."""
        back = None if self.back is None else self.back.as_drawn
        if not (self.is_tinted or self.is_translucent):
            return self
        drawn = replace(self, back=back, tint=Channel.of(1.0), translucency=Channel.of(0.0), shadow_tint=None)
        if self.tint.is_constant and self.alpha.is_constant and self.alpha.offset is None:
            covered = float(self.alpha.constant[0])
            alpha = 1.0 - (1.0 - covered) * float(self.tint.constant.mean())
            share = covered / alpha if alpha > 0 else 1.0
            drawn = replace(drawn, alpha=Channel.of(alpha), albedo=self.albedo.scaled(share), emission=self.emission.scaled(share),
                            base_color=self.base_color.scaled(share))
        elif self.alpha.is_constant and float(self.alpha.constant[0]) == 0.0:
            # Coverage is one number: the middle channel stands for a colour's brightness.
            alpha = replace(self.tint.scaled(-1.0), offset=1.0 - (0.0 if self.tint.offset is None else self.tint.offset),
                            texture_channel="g" if self.tint.texture_channel == "rgb" else self.tint.texture_channel)
            drawn = replace(drawn, alpha=alpha, albedo=Channel.of(0.0), base_color=Channel.of(0.0))
        if self.translucency.may_be_positive and not drawn.albedo.may_be_positive:
            drawn = replace(drawn, albedo=self.translucency)
        elif self.translucency.is_constant and drawn.albedo.is_constant:
            drawn = replace(drawn, albedo=Channel.of(np.minimum(drawn.albedo.constant + self.translucency.constant, 1.0)))
        return drawn

    def shining(self, factor: float) -> "Material":
        """The material with ``factor`` times its emission, on both sides and for cameras too."""
        back, camera = (None if other is None else other.shining(factor) for other in (self.back, self.camera))
        return replace(self, emission=self.emission.scaled(factor), back=back, camera=camera)

    @property
    def is_translucent(self) -> bool:
        """True if light that arrives on one side leaves diffusely from the other."""
        return self.translucency.may_be_positive or (self.back is not None and self.back.is_translucent)

    @property
    def is_tinted(self) -> bool:
        """True if what passes straight through changes its colour."""
        passing = [self.tint] if self.shadow_tint is None else [self.tint, self.shadow_tint]
        own = any(not tint.is_constant or tint.offset is not None or np.any(tint.constant != 1.0) for tint in passing)
        return own or (self.back is not None and self.back.is_tinted)

    @property
    def is_emissive(self) -> bool:
        """True unless the emission is exactly zero everywhere by its constant."""
        return self.emission.may_be_positive or (self.back is not None and self.back.is_emissive)

    @property
    def is_opaque(self) -> bool:
        """True if no ray ever passes through."""
        coverage = [self.alpha] if self.shadow_alpha is None else [self.alpha, self.shadow_alpha]
        own = all(alpha.is_constant and alpha.offset is None and float(alpha.constant[0]) >= 1.0 for alpha in coverage)
        return own and (self.back is None or self.back.is_opaque)
