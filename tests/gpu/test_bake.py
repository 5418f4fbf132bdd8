"""`bake --device gpu` as a user meets it: a process, its exit code and its bundle."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.techniques.kernels import NUMPY

ROOT = Path(__file__).resolve().parents[2]
CORNELL = ROOT / "sample_blends/cornell_box.blend"


def bake(out, technique, device, **environment):
    """Exit code and stderr of the module's door."""
    bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")
    if not getattr(bpy.app, "module", True):
        pytest.skip("a real Blender has no module's door")
    command = [sys.executable, "-m", "rtgi_addon", CORNELL, "bake", "--technique", technique, "--device", device, "--out", out]
    ran = subprocess.run(list(map(str, command)), cwd=ROOT, env={**os.environ, **environment}, capture_output=True, text=True,
                         timeout=300, check=False)
    return ran.returncode, ran.stderr


def sh_of(folder):
    return read_bundle(folder).grids[0].sh


@pytest.mark.slow
@pytest.mark.parametrize("technique", ["rsm", "lpv", "vpl", "cone_tracing"])
def test_both_devices_bake_the_same(gpu_device, tmp_path, technique):
    for device in ("cpu", "gpu"):
        code, err = bake(tmp_path / device, technique, device)
        assert code == 0, err
        assert "Error" not in err
    cpu, gpu = (sh_of(tmp_path / device).astype(np.float64) for device in ("cpu", "gpu"))
    # Rays and raster part at edges of the maps; rsm's probes come from irradiance on the GPU, with its quadrature.
    assert np.sqrt(np.mean((gpu - cpu) ** 2)) < 0.02 * np.sqrt(np.mean(cpu**2))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="hides EGL's drivers, which are Linux's")
def test_without_a_driver_the_error_says_how_to_get_one(tmp_path):
    code, err = bake(tmp_path / "out", "rsm", "gpu", __EGL_VENDOR_LIBRARY_FILENAMES=os.devnull)
    assert code == 1
    lines = [line for line in err.splitlines() if line]
    assert len(lines) == 1 and "libgl1-mesa-dri" in lines[0] and "--device cpu" in lines[0]
    assert not (tmp_path / "out").exists()


def test_outside_blender_the_error_says_where_to_go(tmp_path):
    script = ("import sys; sys.modules['gpu'] = None; sys.path[:0] = ['tests/support']; import scene_builders as build\n"
              "from rtgi_addon.jobs.bake import bake_scene\nbake_scene(build.closed_box(), 'rsm', out=sys.argv[1], device='gpu')")
    ran = subprocess.run([sys.executable, "-c", script, str(tmp_path / "out")], cwd=ROOT, capture_output=True, text=True,
                         check=False)
    assert "BakeError: the GPU is used through Blender, which is not here" in ran.stderr


def test_a_job_takes_any_kernels(tmp_path):
    called = []

    class Counting:
        def __getattr__(self, name):
            called.append(name)
            return getattr(NUMPY, name)

    bake_scene(build.closed_box(), "rsm", {"resolution": 16}, tmp_path / "out", device="gpu", kernels=Counting())
    assert {"capture", "rsm_gather"} <= set(called)


def test_a_technique_that_knows_no_gpu_refuses(tmp_path):
    with pytest.raises(BakeError, match="'probes' does not bake on the device 'gpu': use --device cpu"):
        bake_scene(build.closed_box(), "probes", out=tmp_path / "out", device="gpu", kernels=NUMPY)
