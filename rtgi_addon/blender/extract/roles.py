"""What an object is to rays and to a bake, in Blender's own settings: ray visibility, light probes, linking."""

from collections.abc import Mapping
from dataclasses import dataclass

import bpy

from ...scene.scene import DYNAMIC, STATIC
from ..ui.role_properties import atlas_map
from .light_groups import light_group
from .linking import Links, identity, read_links


@dataclass(frozen=True)
class Role:
    """Of one placement: the fields ``visible_…``, ``bake``, ``light_group`` and those for styles of ``scene.Instance``, what it
    goes by in collections, and the ``links`` of its emission."""

    visible_camera: bool
    visible_diffuse: bool
    visible_shadow: bool
    bake: str
    identity: tuple[int, ...]
    links: Links | None
    pass_index: int = 0
    collections: tuple[str, ...] = ()
    light_group: str = ""
    visible_scatter: bool = True
    atlas: str | None = None

    @property
    def fields(self) -> dict:
        """For ``scene.Instance``."""
        names = ("visible_camera", "visible_diffuse", "visible_shadow", "visible_scatter", "bake", "pass_index", "collections",
                 "light_group", "atlas")
        return {name: getattr(self, name) for name in names}

    @property
    def of_medium(self) -> dict:
        """For ``scene.Medium``, which styles know nothing of."""
        return {name: getattr(self, name) for name in ("visible_camera", "visible_diffuse", "visible_shadow", "bake")}

    @property
    def takes_part(self) -> bool:
        """Whether any ray of a bake or a picture meets it."""
        return self.visible_camera or self.visible_diffuse or self.visible_shadow


def collections_of_objects() -> dict[int, tuple[str, ...]]:
    """The names of the collections that each original object is in, those around them included, by its address."""
    found: dict[int, list[str]] = {}
    for collection in bpy.data.collections:
        for obj in collection.all_objects:
            found.setdefault(obj.as_pointer(), []).append(collection.name)
    return {address: tuple(sorted(names)) for address, names in found.items()}


def read_role(item, collections: Mapping[int, tuple[str, ...]] | None = None) -> Role:
    """The role of a ``DepsgraphObjectInstance``. Like Cycles, an instance is hidden where its object or what makes it is; like
    EEVEE, what is hidden from volume probes is not baked. ``collections`` as ``collections_of_objects`` gives them."""
    owners = [item.object] if item.parent is None else [item.object, item.parent]
    camera, diffuse, shadow, scatter = (all(getattr(owner, name) for owner in owners) for name in (
        "visible_camera", "visible_diffuse", "visible_shadow", "visible_volume_scatter"))
    dynamic = any(owner.hide_probe_volume for owner in owners)
    goes_by = identity(item)
    inside = tuple(dict.fromkeys(name for address in goes_by for name in (collections or {}).get(address, ())))
    return Role(camera, diffuse, shadow, DYNAMIC if dynamic else STATIC, goes_by, read_links(item.object), item.object.pass_index,
                inside, light_group(item.object), scatter, atlas_map(item.object))
