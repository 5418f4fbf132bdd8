"""What a bundle holds beside its probes, where a bake has it: each in a folder of its own, under a key of `bake.json`."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from ..scene import Scene
from ..techniques import Field
from . import atlas_files, bundle_media, lpv_volume, sphere_files, transfer_files, voxel_files


class PartOfBundle(NamedTuple):
    """One of them: its ``key``, ``folder`` and ``index``, the name of the file that lists its others; ``write(folder)`` writes it
    and returns the files' names."""

    key: str
    folder: str
    index: str
    write: Callable[[Path], list[str]]


def parts_of(field: Field, scene: Scene) -> list[PartOfBundle]:
    """What the bundle of ``field`` of ``scene`` has, in the order in which it is written."""
    volumes = field.light_volumes()
    found = (("lpv", lpv_volume, lpv_volume.write_lpv_volume, volumes),
             ("media", bundle_media, bundle_media.write_media, scene.media or None),
             ("transfer", transfer_files, transfer_files.write_transfer, field.transfer),
             ("spheres", sphere_files, sphere_files.write_spheres, field.spheres),
             ("atlas", atlas_files, atlas_files.write_atlas, field.atlas),
             ("voxels", voxel_files, voxel_files.write_voxels, field.lit_voxels()))
    return [PartOfBundle(key, module.FOLDER, module.INDEX, lambda folder, write=write, content=content: write(folder, content))
            for key, module, write, content in found if content is not None]
