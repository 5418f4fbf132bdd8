"""Which emissive surfaces give light to others closer by than probes are apart, and who shows it how: what users are told."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...numerics.grid import cell_volume
from ...numerics.sampling import about, cosine_hemisphere, sobol_owen
from ...scene import ProbeVolume
from ...transport.context import LightContext
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import luminance
from .near_light import NEAR_SHARE, WORTH, near_emitters, spacings, why_not

# Points on all that emits, each seen from both sides; an emitter that is just worth it has some thirty of them.
_LOOKS = 1 << 15
# So many names are told.
_TOLD = 6
_SEED = 0x3300


class NearGlow(NamedTuple):
    """Names of what gives light to others closer by than probes are apart: what is drawn ``at_pixels`` (near_light.py), and what
    is shown ``blurred``; ``why`` all of it is, if there is a reason in the scene."""

    at_pixels: tuple[str, ...] = ()
    blurred: tuple[str, ...] = ()
    why: str = ""

    def to_json(self) -> dict:
        """As a bake's statistics have it."""
        return {"at_pixels": list(self.at_pixels), "blurred": list(self.blurred)}


def near_glow(context: LightContext, volumes: Sequence[ProbeVolume], fitted: bool = False) -> NearGlow:
    """What glows so close to other surfaces beside probes of ``volumes``, which are ``fitted`` or not."""
    if not any(volume.capture_emission for volume in volumes):
        return NearGlow()
    volumes = sorted(volumes, key=lambda volume: cell_volume(volume.world_from_local, volume.nodes))
    found = _glowing_near(context, volumes)
    if not found:
        return NearGlow()
    scene, why = context.scene, why_not(context.scene, volumes, fitted)
    drawn = [] if why else near_emitters(context, volumes)
    known = {(item.instance, item.material) for item in drawn}
    blurred = (scene.instances[instance].name for instance, material in found if (instance, material) not in known)
    return NearGlow(tuple(dict.fromkeys(item.name for item in drawn)), tuple(dict.fromkeys(blurred)), why)


def notes_on(glow: NearGlow) -> tuple[str, ...]:
    """``glow`` for users; nothing where there is none."""
    notes, names, blurred = [], _listed(dict.fromkeys((*glow.at_pixels, *glow.blurred))), _listed(glow.blurred)
    if not names:
        return ()
    if glow.why:
        notes.append(f"light of {names} falls on surfaces closer by than probes are apart, and they hold it blurred over a cell: "
                     f"pictures and engines show it so, for {glow.why} (finer cells there mend it, or lamps in place of meshes)")
    elif not glow.at_pixels:
        notes.append(f"light of {names} falls on surfaces closer by than probes are apart, and they hold it blurred over a cell: "
                     "pictures and engines show it so, for only what shines evenly from few flat faces is drawn at each pixel "
                     "(finer cells there mend it, or lamps in place of meshes)")
    elif blurred:
        notes.append(f"light of {names} falls on surfaces closer by than probes are apart, and they hold it blurred over a cell: "
                     f"RTGI draws it at each pixel, but not that of {blurred} (only what shines evenly from few flat faces), and "
                     "engines show it blurred (finer cells there mend it, or lamps in place of meshes; --fit lessens it, in "
                     "engines only)")
    else:
        notes.append(f"light of {names} falls on surfaces closer by than probes are apart, and they hold it blurred over a cell: "
                     "RTGI draws it at each pixel, engines show it blurred (finer cells there mend it, or lamps in place of "
                     "meshes; --fit lessens it, in engines only)")
    return tuple(notes)


def _listed(names) -> str:
    names = list(names)
    return ", ".join(names if len(names) <= _TOLD else [*names[:_TOLD - 1], f"… (+{len(names) - _TOLD + 1})"])


def _glowing_near(context: LightContext, volumes: Sequence[ProbeVolume]) -> list[tuple[int, int]]:
    """(instance, material) of all that is worth it by NEAR_SHARE and WORTH, alone or with all of its material, whatever its shape;
    the brightest close by first."""
    table, geometry = context.emitters, context.geometry
    if not table.count:
        return []
    u = sobol_owen(_LOOKS, 5, _SEED)
    emitted = table.sample(u[:, :3])
    primitive, reach, closed = emitted.primitive, spacings(volumes, emitted.points), context.solids.is_solid(emitted.primitive)
    instance, material = geometry.instance[primitive].astype(np.int64), geometry.material[primitive].astype(np.int64)
    owner, row = np.unique(np.stack([instance, material], axis=1), axis=0, return_inverse=True)
    given = near = np.zeros(len(owner))
    for side in (1, -1):
        power = np.pi * luminance(table.mean_radiance(emitted, side)).astype(np.float64) / emitted.pdf_area / _LOOKS
        rows = np.flatnonzero((power > 0) & ~(closed & (side < 0)))
        normals = (side * emitted.normals[rows]).astype(np.float32)
        directions = about(normals, cosine_hemisphere(u[rows, 3:]))
        hits = context.tracer.intersect(offset_origins(emitted.points[rows], normals, normals), directions)
        others = geometry.instance[np.maximum(hits.primitive, 0)] != instance[rows]
        met = (hits.primitive >= 0) & (hits.t < reach[rows]) & others
        given = given + np.bincount(row.reshape(-1)[rows], power[rows], len(owner))
        near = near + np.bincount(row.reshape(-1)[rows], power[rows] * met, len(owner))
    close = (near > 0) & (near >= NEAR_SHARE * given)
    # Of many small ones each may be nothing, and all of a material much.
    group = np.unique(owner[:, 1], return_inverse=True)[1].reshape(-1)
    given, together = (np.bincount(group, values)[group] for values in (given, near))
    least = WORTH * table.total_power
    worth = np.flatnonzero(close & ((near >= least) | ((together >= least) & (together >= NEAR_SHARE * given))))
    return [(int(owner[index, 0]), int(owner[index, 1])) for index in worth[np.argsort(-near[worth], kind="stable")]]
