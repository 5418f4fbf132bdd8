"""Registries that fill themselves: a folder whose files each end in ``ATTRIBUTE = Name()`` finds them, so that adding one is adding
one file."""

import importlib
import pkgutil
from collections.abc import Iterable, Mapping
from typing import TypeVar

from .errors import UsageError

Found = TypeVar("Found")


def discover(package: str, path: Iterable[str], attribute: str) -> dict:
    """Every object called ``attribute`` in the modules of ``package`` (its ``__path__`` is ``path``), by its ``name``, in
    alphabetical order."""
    modules = (importlib.import_module(f"{package}.{info.name}") for info in pkgutil.iter_modules(path))
    found = [getattr(module, attribute) for module in modules if hasattr(module, attribute)]
    return {entry.name: entry for entry in sorted(found, key=lambda entry: entry.name)}


def named(registry: Mapping[str, Found], name: str, kind: str) -> Found:
    """The entry called ``name``. Raises UsageError, which calls it a ``kind``, with the list of known ones."""
    if name not in registry:
        raise UsageError(f"unknown {kind} {name!r}", f"choose one of {', '.join(registry)}")
    return registry[name]
