"""Volume names as folder names."""

import pytest

from rtgi_addon.exchange.names import folder_names


@pytest.mark.parametrize(("name", "folder"), [
    ("Volume.001", "Volume.001"), ("a/b\\c", "a_b_c"), ("../../etc", "etc"), ("", "volume"), ("...", "volume"),
    ("Höhle 1", "H_hle_1"),
    ("日本", "volume"), ("CON", "volume_CON"), ("nul.x", "volume_nul.x"), ("x" * 200, "x" * 64), ("trailing. ", "trailing"),
])
def test_a_name_becomes_a_safe_folder(name, folder):
    assert folder_names([name]) == [folder]


def test_folders_are_unique_where_case_does_not_count():
    assert folder_names(["a", "A", "a/", "b", "a-2"]) == ["a", "A-2", "a-3", "b", "a-2-2"]


def test_reserved_names_are_avoided():
    assert folder_names(["bake.json"], reserved=["bake.json"]) == ["bake.json-2"]
