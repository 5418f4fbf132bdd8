"""Registries find what files bring, in order, and know what they lack."""

from types import SimpleNamespace

import pytest

from rtgi_addon.discovery import discover, named
from rtgi_addon.errors import UsageError
from rtgi_addon.exchange import engines


def test_files_are_found_by_what_they_end_in(tmp_path, monkeypatch):
    package = tmp_path / "shelf"
    package.mkdir()
    (package / "__init__.py").write_text("")
    for module, name in (("a", "zebra"), ("b", "ant")):
        (package / f"{module}.py").write_text(f"class Thing:\n    name = {name!r}\n\nTHING = Thing()\n")
    (package / "helper.py").write_text("OTHER = 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    found = discover("shelf", [str(package)], "THING")
    assert list(found) == ["ant", "zebra"] and found["ant"].name == "ant"


def test_what_is_not_there_is_told_with_what_is():
    shelf = {"ant": SimpleNamespace(), "zebra": SimpleNamespace()}
    assert named(shelf, "ant", "thing") is shelf["ant"]
    with pytest.raises(UsageError, match="unknown thing 'bee': choose one of ant, zebra"):
        named(shelf, "bee", "thing")


def test_engines_answer_to_their_aliases():
    for engine in engines.registry().values():
        assert all(engines.get(alias) is engine for alias in (engine.name, *engine.aliases))
    with pytest.raises(UsageError, match="unknown engine"):
        engines.get("abacus")
