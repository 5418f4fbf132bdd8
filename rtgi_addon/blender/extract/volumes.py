"""Probe volumes: Blender's own Light Probe Volume objects."""

import numpy as np

from ...errors import UsageError
from ...scene import NearSurfaces, ProbeVolume


def is_volume(obj) -> bool:
    """True for a Light Probe Volume object (data type 'VOLUME', 'GRID' in older files)."""
    return obj.type == "LIGHT_PROBE" and obj.data.type in {"VOLUME", "GRID"}


def read_volume(obj, matrix_world) -> ProbeVolume:
    """An evaluated Light Probe Volume as ``ProbeVolume``. ``settings`` and ``near``: what the data's ``rtgi`` property
    group says.

    Blender has Capture World off for every new volume, and lights by the world apart from them then; what that changes is said in
    `scene.capture`.
    """
    probe = obj.data
    own = getattr(probe.original, "rtgi", None)
    overrides = getattr(own, "overrides", None)
    near = None
    if getattr(own, "near_surfaces", False):
        near = NearSurfaces(float(own.clearance), float(own.outside), bool(own.outermost))
    return ProbeVolume(obj.name, np.array(matrix_world, np.float64),
                       (probe.resolution_x, probe.resolution_y, probe.resolution_z),
                       settings=dict(overrides()) if callable(overrides) else {},
                       capture_world=bool(getattr(probe, "capture_world", True)),
                       capture_emission=bool(getattr(probe, "capture_emission", True)),
                       capture_bounces=bool(getattr(probe, "capture_indirect", True)),
                       intensity=float(getattr(probe, "intensity", 1.0)), near=near, planned=getattr(own, "planned", ""))


def select_volumes(found: list[ProbeVolume], names: list[str] | None) -> list[ProbeVolume]:
    """The volumes called ``names`` in that order (None = all). Raises UsageError with the known names."""
    if not names:
        return found
    by_name = {volume.name: volume for volume in found}
    for name in names:
        if name not in by_name:
            known = f"choose one of {', '.join(by_name)}" if by_name else "the file has no visible Light Probe Volume: add one"
            raise UsageError(f"unknown probe volume {name!r}", known)
    return [by_name[name] for name in dict.fromkeys(names)]
