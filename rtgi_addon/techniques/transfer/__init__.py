"""Precomputed radiance transfer: probes that store what they make of any light, and are relit without a ray.

Papers: Sloan, Kautz and Snyder, "Precomputed Radiance Transfer for Real-Time Rendering in Dynamic, Low-Frequency Lighting
Environments", SIGGRAPH 2002 (transfer of skies as matrices between SH); N. Stefanov, "Deferred Radiance Transfer Volumes", GDC 2012
(Far Cry 3: sky visibility apart from bounced light, on a lattice, relit at run time). Suns go by a table of directions, never
through SH, and the bake's own lamps and emissive surfaces by groups, each exactly.

What it is not: transfer between moving things. Surfaces are those of the bake; a sun between the table's directions is as wrong as
docs/techniques/transfer.md measures.
"""

from dataclasses import asdict

import numpy as np

from ...progress import Progress
from ...scene import Omission, ProbeVolume, Scene
from ...scene.lights import held_directly
from ..base import Checkpoint, Field, Technique, all_captured, begin_bake, volumes_by_settings
from .bake import TransferBake
from .columns import dark_context, light_columns
from .data import Transfer
from .field import TransferField
from .follow import sources_of
from .lighting import coarse
from .media import media_left_out
from .settings import TransferSettings
from .surfaces import surfaces_of


class TransferTechnique(Technique):
    """Bakes transfer; see the module's docstring."""

    name = "transfer"
    label = "Radiance Transfer"
    description = "Irradiance probes that follow sun, sky and groups of lights without a new bake"
    Settings = TransferSettings
    tolerance = 0.03
    not_weighed = "probes for any sky and sun, which take more rays than probes for one"
    transfers = True
    presets = {"draft": {"rays": 512}, "preview": {"rays": 2048}, "final": {"rays": 8192}}

    def bake(self, scene: Scene, settings: TransferSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None) -> Field:
        """See Technique.bake."""
        context, seed = begin_bake(scene, settings, rng, progress, threads)
        settings, overruled = one_for_all(scene.volumes, settings)
        dark = dark_context(scene, threads)
        columns = list(light_columns(scene, dark))
        bake = TransferBake(dark, columns, scene.volumes, settings, seed, progress, checkpoint)
        grids = bake.run()
        held = frozenset(context.scene.lights[index].name for index in held_directly(context.scene.lights))
        transfer = Transfer(grids, settings.order, settings.sky_order, settings.sun_side, settings.sun_below,
                            tuple((column.name, column.kind) for column in columns), bake.site_positions, coarse(scene.world),
                            surfaces_of(scene), sources_of(scene), settings.half, settings.sun_vectors)
        stats = {"rays": int(bake.ray_count + bake.cache.count * bake.cache.rays), "texels": int(bake.cache.count),
                 "texel_size": float(bake.cache.layout.size), "bytes_per_probe": transfer.bytes_per_probe}
        field = TransferField(transfer, direct_lamps=held, params=asdict(settings), stats=stats)
        field.omissions = (*overruled, *all_captured(self.name, scene.volumes), *media_left_out(scene))
        return field

    def sweep(self) -> tuple[TransferSettings, ...]:
        """Rays, and SH of order 1, which engines with small probes store."""
        return TransferSettings(rays=512), TransferSettings(order=1), TransferSettings(), TransferSettings(rays=8192)


def one_for_all(volumes: tuple[ProbeVolume, ...], settings: TransferSettings) -> tuple[TransferSettings, tuple[Omission, ...]]:
    """The settings of a bake of ``volumes``, which share columns and one table of suns: what they override holds if all override
    the same. Otherwise ``settings`` hold, and the second names the volumes that wanted others. Raises UsageError for an override
    out of range."""
    groups = volumes_by_settings(volumes, settings)
    wanted = list(dict.fromkeys(of_group for of_group, _ in groups))
    if len(wanted) == 1:
        return wanted[0], ()
    others = [volume.name for of_group, members in groups if of_group != settings for volume in members]
    return settings, tuple(Omission(f"transfer bakes all volumes with the same settings: those of volume {name} are not followed",
                                    objects=(name,)) for name in others)


TECHNIQUE = TransferTechnique()
