"""What a surface reflects, emits and lets through, as plain arrays that know nothing of Blender's nodes."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class Texture:
    """An image sampled by UV.

    ``pixels`` is (height, width, channels) with row 0 at v = 0 (Blender's bottom-up order), channels 1, 3 or 4, dtype uint8
    or float32. ``srgb`` says that RGB is sRGB-encoded: texels are filtered as they are stored and the result is decoded, as in
    Cycles; alpha never is.
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
    ``backface_culling`` is the user's statement that the surface is seen from its front only; light transport is two-sided
    all the same, as in Cycles. ``extraction`` says how it was read: 'nodes' or 'cycles-bake'.
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

    @property
    def is_emissive(self) -> bool:
        """True unless the emission is exactly zero everywhere by its constant."""
        offset = 0.0 if self.emission.offset is None else self.emission.offset
        return bool(np.any(self.emission.constant > 0) or np.any(np.asarray(offset) > 0))

    @property
    def is_opaque(self) -> bool:
        """True if no ray ever passes through."""
        return self.alpha.is_constant and self.alpha.offset is None and float(self.alpha.constant[0]) >= 1.0
