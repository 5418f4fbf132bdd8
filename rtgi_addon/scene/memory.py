"""How much memory a bake of a scene takes, beyond the scene itself, and what to say where that is more than there is.

The constants are peaks of resident memory less what was there before, measured from 20 to 3 million triangles, 27 to 100,000
probes, 1 to 2,000 lamps and images of 2048² texels.
"""

import numpy as np

from ..errors import BakeError
from ..machine.memory import available_bytes
from .scene import Scene

# In world space: corners, normal, area and indices, Embree's copy and BVH.
BYTES_PER_TRIANGLE = 300
# Its SH coefficients (RGB, for the running sums and the result), and beside them the depth tile, flags and what is put together.
BYTES_PER_COEFFICIENT, BYTES_PER_PROBE = 76, 3000
# Code that is loaded only now and small tables; the stack and temporaries of a thread.
BASE_BYTES, BYTES_PER_THREAD = 8 << 20, 4 << 20
# An image is read in texels of four channels. The world is split into bright patches and the rest, in double precision.
CHANNELS, BYTES_PER_WORLD_TEXEL = 4, 115

_REMEDIES = {
    "geometry": "hide what the probes do not need to see, or simplify its meshes",
    "textures": "lower the size of its images",
    "probes": "lower the volume's resolution or the SH order",
    "threads": "use fewer threads",
    "shadow maps": "lower the resolution of the lamps' maps, or leave out lamps",
    "virtual lights": "lower the number of virtual lights, or of candidates for each",
    "cells": "lower the resolution of the volumes, or use fewer cascades",
    "voxels": "lower the resolution, raise the voxel size, or use fewer cascades",
    "the surface cache": "allow a larger error, set a larger texel size, or place the volumes closer to what they light",
    "the fit to surfaces": "leave out --fit (Fit to Surfaces), or lower the volume's resolution",
    "rays": "use fewer threads, a larger error or a lower resolution",
}


def estimate_bytes(scene: Scene, sh_order: int) -> dict[str, int]:
    """Bytes that any bake at ``sh_order`` takes beyond what is loaded already and the scene, by what takes them: program, geometry,
    textures, probes. What a technique takes to work with comes on top."""
    triangles = sum(len(scene.meshes[instance.mesh].triangles) for instance in scene.instances)
    images = {id(channel.texture.pixels): channel.texture.pixels for material in scene.materials
              for channel in material.channels() if channel.texture is not None}
    textures = sum(CHANNELS * pixels[..., 0].size * pixels.itemsize for pixels in images.values() if pixels.shape[-1] != CHANNELS)
    probes = sum(x * y * z for x, y, z in (volume.resolution for volume in scene.volumes) if min(x, y, z) > 0)
    return {
        "program": BASE_BYTES,
        "geometry": triangles * BYTES_PER_TRIANGLE,
        "textures": textures + BYTES_PER_WORLD_TEXEL * np.asarray(scene.world.equirect)[..., 0].size,
        "probes": probes * (BYTES_PER_PROBE + (sh_order + 1) ** 2 * BYTES_PER_COEFFICIENT),
    }


def shortage(needs: dict[str, int], free: int | None) -> tuple[str, str] | None:
    """What is wrong and what to do if ``needs`` (bytes by what takes them) are more than is ``free`` (None: unknown), else None."""
    total = sum(needs.values())
    if free is None or total <= free:
        return None
    # Of what somebody can do something about.
    largest = max(needs.keys() & _REMEDIES.keys(), key=needs.get)
    return (f"needs about {_size(total)} of memory, most of it for {largest} ({_size(needs[largest])}); {_size(free)} are free",
            _REMEDIES[largest])


def require_memory(needs: dict[str, int]) -> None:
    """Raise BakeError if ``needs`` (bytes by what takes them) are more than this process may still take."""
    found = shortage(needs, available_bytes())
    if found is not None:
        raise BakeError(f"the bake {found[0]}", found[1])


def _size(count: int) -> str:
    return f"{count / 2**30:.1f} GiB" if count >= 2**30 else f"{count / 2**20:.0f} MiB"
