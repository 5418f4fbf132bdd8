"""Fixtures for every test. Scenes in plain numpy are in tests/support/scene_builders.py."""

import pytest


@pytest.fixture
def empty_blend():
    """The bpy module with a fresh, empty file open at factory settings; add-ons stay registered. Skips without bpy."""
    bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield bpy
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
