"""What every test on the GPU is held to besides what it says itself."""

import gc

import pytest


@pytest.fixture(scope="module", autouse=True)
def no_cycle_holds_what_is_on_the_gpu():
    """Python collects cycles on whichever thread it happens to be, and under Vulkan Blender takes textures that another thread lets
    go of from under commands that it has not sent yet. So nothing that holds them may be left for the collector."""
    gc.collect()
    gc.disable()
    yield
    gc.set_debug(gc.DEBUG_SAVEALL)
    try:
        gc.collect()
        held = {(type(thing).__name__, type(held).__name__) for thing in gc.garbage for held in gc.get_referents(thing)
                if type(held).__name__.startswith("GPU")}
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()
    assert not held, "cycles hold what is on the GPU"
