"""How much memory a bake of a scene takes, and how much there is."""

import ctypes
import os
from pathlib import Path

from .scene import Scene

# Per triangle in world space: corners, normal, area and indices, Embree's copy and BVH, the surface cache's texels and their
# hits. 1.1 kB were measured on the atrium sample (peak memory less that after extraction); a wrong alarm costs less than a
# machine that swaps.
BYTES_PER_TRIANGLE = 1200
# Per probe and SH coefficient: RGB sums in float64 for the running scrambles; per probe beside them: the depth tile and flags.
BYTES_PER_COEFFICIENT = 3 * 8 * 9
BYTES_PER_PROBE = 8 * 8 * 2 * 8 + 128


def estimate_bytes(scene: Scene, sh_order: int) -> dict[str, int]:
    """Bytes that a bake at ``sh_order`` takes beyond the program itself, by what takes them: geometry, textures, probes."""
    triangles = sum(len(scene.meshes[instance.mesh].triangles) for instance in scene.instances)
    textures = {id(channel.texture.pixels): channel.texture.pixels.nbytes for material in scene.materials
                for channel in (material.albedo, material.emission, material.alpha) if channel.texture is not None}
    textures[id(scene.world.equirect)] = 2 * scene.world.equirect.nbytes
    probes = sum(x * y * z for x, y, z in (volume.resolution for volume in scene.volumes) if min(x, y, z) > 0)
    return {
        "geometry": triangles * BYTES_PER_TRIANGLE,
        "textures": sum(textures.values()),
        "probes": probes * (BYTES_PER_PROBE + (sh_order + 1) ** 2 * BYTES_PER_COEFFICIENT),
    }


def available_bytes() -> int | None:
    """Memory this process may still take: what the system has free, less where a control group allows less. None if unknown."""
    limits = [value for value in (_free_on_linux(), _control_group_left(), _free_on_windows(), _total_by_sysconf()) if value]
    return min(limits) if limits else None


def _free_on_linux() -> int | None:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError, IndexError):
        return None
    return None


def _control_group_left() -> int | None:
    """What a container's limit leaves (cgroup v2); file cache counts as free, since it gives way."""
    root = Path("/sys/fs/cgroup")
    try:
        statistics = dict(line.split() for line in (root / "memory.stat").read_text().splitlines())
        return max(int((root / "memory.max").read_text()) - int((root / "memory.current").read_text())
                   + int(statistics["inactive_file"]), 1)
    except (OSError, ValueError, KeyError):  # no such file, or "max": no limit
        return None


def _total_by_sysconf() -> int | None:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None


def _free_on_windows() -> int | None:
    if not hasattr(ctypes, "windll"):
        return None

    class MemoryStatus(ctypes.Structure):
        _fields_ = [("length", ctypes.c_ulong), ("load", ctypes.c_ulong)] + [(name, ctypes.c_ulonglong) for name in (
            "total", "available", "total_page", "available_page", "total_virtual", "available_virtual", "extended")]

    status = MemoryStatus(length=ctypes.sizeof(MemoryStatus))
    return int(status.available) if ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)) else None
