"""A GPU context through Blender, software drivers included; every test here skips, with the reason, where there is none."""

import pytest


@pytest.fixture(scope="session")
def gpu_device():
    """Blender's gpu module, ready; at factory settings with an empty file."""
    pytest.importorskip("bpy", reason="needs Blender or its Python module")
    from rtgi_addon.blender.gpu_context import open_context
    from rtgi_addon.errors import BakeError
    try:
        open_context()
    except BakeError as error:
        pytest.skip(f"no GPU context: {error}")
    from rtgi_addon.preview.kernels import GpuKernels
    return GpuKernels()
