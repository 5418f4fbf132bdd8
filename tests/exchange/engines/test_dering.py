"""Deringing at run time in engines' languages, held to numpy's."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from egl_contexts import current_context_kept

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines.glsl import relight_glsl, shared_glsl
from rtgi_addon.numerics import sh
from rtgi_addon.techniques.lattice.reconstruction import dering

COUNT = 1000
MAIN = """
layout(local_size_x = 50) in;
layout(std430, binding = 0) buffer Probes { float values[]; };
void main() {
  uint first = 27u * gl_GlobalInvocationID.x;
  vec3 c[9];
  for (uint i = 0u; i < 9u; i++) {
    c[i] = vec3(values[first + 3u * i], values[first + 3u * i + 1u], values[first + 3u * i + 2u]);
  }
  rtgi_dering(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]);
  for (uint i = 0u; i < 27u; i++) {
    values[first + i] = c[i / 3u][i % 3u];
  }
}
"""


@pytest.fixture(scope="module")
def probes():
    """Probes of any brightness that ring, most of them, and some without a band, a colour or the mean of one."""
    rng = np.random.default_rng(3)
    values = 0.5 * rng.normal(size=(COUNT, 9, 3))
    values[:, 0] = np.abs(values[:, 0]) + 0.3
    values[0, 1:4] = values[1, 4:] = values[2, :, 1] = values[4, [1, 2, 4, 5, 7]] = 0.0
    values[3, 0, 2] = -1.0
    return (values * np.exp(3.0 * rng.normal(size=(COUNT, 1, 1)))).astype(np.float32)


def off(found, probes):
    return (np.abs(found - dering(probes)).max(axis=(1, 2)) / np.abs(probes).max(axis=(1, 2))).max()


def test_shaders_dering_as_numpy(probes):
    moderngl = pytest.importorskip("moderngl", reason="moderngl is not installed: it is for benchmarks")
    with current_context_kept():
        try:
            context = moderngl.create_context(standalone=True, backend="egl", require=430)
        except Exception as error:
            pytest.skip(f"no OpenGL context: {error}")
        buffer = context.buffer(probes.tobytes())
        buffer.bind_to_storage_buffer(0)
        text = relight_glsl()
        text = text[:text.index("// The nine coefficients of a probe, deringed")]
        context.compute_shader("#version 430\n" + shared_glsl() + text + MAIN).run(COUNT // 50)
        found = np.frombuffer(buffer.read(), np.float32).reshape(probes.shape)
        context.release()
    assert off(found, probes) < 5e-5


def test_scripts_dering_as_numpy(probes, tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("needs Node.js 20 or later: `node` is not installed")
    text = (Path(engines.__file__).parent / "threejs/export/rtgi/RTGIRelight.js").read_text()
    zonal, cosine = np.sqrt(5.0 / np.pi) / 4.0, sh.cosine_coefficients(2)[[0, 1, 4]]
    factors = cosine * [np.sqrt(1.0 / (4.0 * np.pi)), np.sqrt(3.0 / (4.0 * np.pi)), np.sqrt(15.0 / (4.0 * np.pi))]
    numbers = ", ".join(f"COSINE_{band} = {factor}" for band, factor in enumerate(factors))
    text = text[text.index("function dering(c)"):]
    script = (f"const COEFFICIENTS = 9, {numbers}, COSINE_2_ZONAL = {cosine[2] * zonal};\n" + text
              + "\nconst all = JSON.parse(require('fs').readFileSync(0));\nall.forEach((one) => dering(one));\n"
              "console.log(JSON.stringify(all));")
    (tmp_path / "dering.cjs").write_text(script)
    ran = subprocess.run([node, tmp_path / "dering.cjs"], input=json.dumps(probes.reshape(COUNT, 27).tolist()), capture_output=True,
                         text=True, timeout=60, check=True)
    assert off(np.array(json.loads(ran.stdout)).reshape(probes.shape), probes) < 1e-5
