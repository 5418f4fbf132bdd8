"""Fixtures for every test. Scenes in plain numpy are in tests/support/scene_builders.py."""

import pytest


@pytest.fixture
def empty_blend():
    """The bpy module with a fresh, empty file open at factory settings; add-ons stay registered. Skips without bpy."""
    bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield bpy
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@pytest.fixture(scope="session")
def gpu_device():
    """Blender's gpu module, ready; at factory settings with an empty file. Software drivers will do; skips where there is none."""
    pytest.importorskip("bpy", reason="needs Blender or its Python module")
    from rtgi_addon.blender.gpu_context import open_context
    from rtgi_addon.errors import BakeError
    try:
        open_context()
    except BakeError as error:
        pytest.skip(f"no GPU context: {error}")
    from rtgi_addon.preview.kernels import GpuKernels
    return GpuKernels()
