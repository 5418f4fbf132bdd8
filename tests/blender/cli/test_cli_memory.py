"""A process that may not have enough memory says so: never a crash, a wait or an error without a remedy."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scene_builders import closed_box

from rtgi_addon.errors import out_of_memory
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.rays import embree

ROOT = Path(__file__).resolve().parents[3]
CORNELL = ROOT / "sample_blends/cornell_box.blend"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux limits address space")
@pytest.mark.parametrize("mebibytes", [1200, 1400, 1500, 1560])
def test_a_limit_of_the_address_space_is_an_error_with_a_remedy(tmp_path, mebibytes):
    """From too little for Blender alone to just enough; where Blender and Embree used to end in a segmentation fault."""
    pytest.importorskip("bpy", reason="needs Blender's Python module")
    run = f"exec {sys.executable} -m rtgi_addon {CORNELL} bake --rays 16 --out {tmp_path}/out"
    limited = f"ulimit -c 0; ulimit -v {mebibytes * 1024}; {run}"
    done = subprocess.run(["sh", "-c", limited], capture_output=True, text=True, cwd=ROOT, timeout=120)
    errors = [line for line in done.stderr.splitlines() if line.startswith("rtgi: error: ")]
    assert done.returncode in (0, 1), done.stderr
    assert len(errors) == done.returncode and (tmp_path / "out").exists() != bool(errors)
    assert all("memory" in line or "address space" in line for line in errors)
    if mebibytes == 1200:
        assert "raise the limit (ulimit -v)" in errors[0]


def test_the_ray_tracer_is_not_begun_without_room_for_it(monkeypatch):
    if not embree.is_available():
        pytest.skip("there is no Embree here")
    context = LightContext(closed_box())
    monkeypatch.setattr(embree, "available_bytes", lambda: 1000)
    with pytest.raises(MemoryError, match="the ray tracer needs 8 MiB, 0 are left"):
        embree.EmbreeTracer(context.geometry)
    monkeypatch.setattr(embree, "available_bytes", lambda: None)
    monkeypatch.setattr(embree, "address_bytes_left", lambda: 100 << 20)
    with pytest.raises(MemoryError, match="152 MiB, 100 are left"):
        embree.EmbreeTracer(context.geometry)


def test_what_means_no_memory_is_told_from_other_errors():
    try:
        np.empty(1 << 60, np.uint8)
    except MemoryError as error:
        assert "Unable to allocate" in out_of_memory(error).cause and out_of_memory(error).remedy
    assert out_of_memory(MemoryError()).cause == "there is not enough memory (an array did not fit)"
    assert out_of_memory(RuntimeError("can't start new thread")) is not None
    assert out_of_memory(RuntimeError("other")) is None and out_of_memory(ValueError("x")) is None
