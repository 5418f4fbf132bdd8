"""What a user may set for the preview."""

from dataclasses import dataclass

from ..effects import EFFECT_PASSES
from ..techniques.base import setting

# Everything that a frame can be asked for, in the order of film.comp.glsl; scene-linear, four floats a pixel.
PASSES = ("combined", "direct", "indirect", "irradiance", "albedo", "normal", "depth", "object")


@dataclass(frozen=True)
class PreviewSettings:
    """What the preview shows, and how much work a frame may be."""

    samples: int = setting(64, "Samples", "Frames that are averaged until a still picture is done", "", 1, 65536)
    resolution_scale: float = setting(1.0, "Resolution", "Share of the region's width and height that is rendered", "", 0.1, 1.0)
    mode: str = setting("combined", "Show", "What the viewport shows", choices=(*PASSES[:-1], *EFFECT_PASSES))
    shadow_resolution: int = setting(1024, "Shadow Map", "Texels along each side of a shadow map", "px", 64, 8192)
    shadow_cascades: int = setting(3, "Sun Cascades", "Shadow maps a sun has, for near to far parts of the view", "", 1, 6)
    shadow_views: int = setting(64, "Shadow Views", "Shadow maps drawn a frame; where lamps need more, every frame has its "
                                "share of them", "", 8, 4096)
    camera_points: int = setting(4096, "Moving Points", "Points of what has moved that every frame puts into voxels, of what the "
                                 "camera sees, until they are made anew; 0 for none", "", 0, 65536)
    film_transparent: bool = setting(False, "Transparent", "Leave the world out of the picture; it still lights the scene")


@dataclass(frozen=True)
class OverlaySettings:
    """What is drawn over the picture."""

    probes: str = setting("none", "Probes", "Spheres where the probes are: in the light that they hold, those of sphere probes as "
                                            "mirrors, or coloured by whether they are usable (green), moved (orange) or inside "
                                            "geometry (red)",
                          choices=("none", "light", "validity"))
    probe_size: float = setting(1.0, "Probe Size", "How large the spheres of probes are", "", 0.1, 5.0)
    voxels: str = setting("none", "Voxels", "The cubes that cone tracing and voxel marching see the scene in: in the light that "
                                            "their faces send out, or white for what they block of it",
                          choices=("none", "light", "opacity"))
    voxel_level: int = setting(0, "Voxel Level", "Which voxels are shown: 0 are the finest, and each level's are twice as large as "
                                                 "those of the last", "", 0, 10)
    bounds: bool = setting(False, "Volume Bounds", "The boxes of the probe volumes")
    leaks: bool = setting(False, "Leaks", "Colours on surfaces for how far the light is off there: red is too bright, blue is too "
                                          "dark; what was measured last with Find Leaks")
