"""Light and shadow linking: collections of Blender's objects as sets of instances.

An entry of a collection includes or excludes an object, or all that is in a child collection. What is excluded is out; where
anything is included, only that is in. An instance goes by its own object or by the object that makes it.
"""

from typing import NamedTuple

import numpy as np

from ...scene import Linking


class Members(NamedTuple):
    """Addresses of the original objects that a linking collection includes and excludes."""

    included: frozenset[int]
    excluded: frozenset[int]


class Links(NamedTuple):
    """Of a light: ``Members`` that it lights and that cast its shadows; None: everything."""

    receivers: Members | None
    blockers: Members | None


def read_links(obj) -> Links | None:
    """The linking of an evaluated lamp or emissive object, None where it lights everything."""
    linking = getattr(obj.original, "light_linking", None)
    if linking is None or not (linking.receiver_collection or linking.blocker_collection):
        return None
    return Links(_members(linking.receiver_collection), _members(linking.blocker_collection))


def identity(item) -> tuple[int, ...]:
    """What a ``DepsgraphObjectInstance`` goes by in collections."""
    own = item.object.original.as_pointer()
    return (own,) if item.parent is None else (own, item.parent.original.as_pointer())


def resolve(links: Links | None, identities: list[tuple[int, ...]]) -> Linking | None:
    """``links`` over the instances that go by ``identities``."""
    if links is None:
        return None
    return Linking(*(None if members is None else _chosen(members, identities) for members in links))


def _chosen(members: Members, identities) -> np.ndarray:
    def is_in(names):
        wanted = not members.included or any(name in members.included for name in names)
        return wanted and not any(name in members.excluded for name in names)

    return np.array([is_in(names) for names in identities], bool)


def _members(collection) -> Members | None:
    if collection is None:
        return None
    found: dict[str, set] = {"INCLUDE": set(), "EXCLUDE": set()}
    for entry, obj in zip(collection.collection_objects, collection.objects, strict=True):
        found[entry.light_linking.link_state].add(obj.as_pointer())
    for entry, child in zip(collection.collection_children, collection.children, strict=True):
        found[entry.light_linking.link_state].update(obj.as_pointer() for obj in child.all_objects)
    return Members(frozenset(found["INCLUDE"]), frozenset(found["EXCLUDE"]))
