"""A style in an export to three.js: its files, what Node says of them, and its shaders as three writes them, in a bare context of
OpenGL that takes WebGL's language, against numpy."""

import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from egl_contexts import current_context_kept

from rtgi_addon.effects.lit import light_context
from rtgi_addon.effects.stylized import EFFECT
from rtgi_addon.effects.stylized.grading import graded
from rtgi_addon.effects.stylized.presets import STYLES
from rtgi_addon.effects.stylized.shading import _highlight, rim, saturated, shaded
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.engines.style import DRAWN, SIZE, ramp_scale, still_life
from rtgi_addon.exchange.engines.threejs.style_file import notes_on_style, surface_values
from rtgi_addon.scene import Scene
from rtgi_addon.transport.vectors import luminance
from rtgi_addon.transport.views.gbuffer import draw_gbuffer

THREE = engines.get("threejs")
SHADERS = Path(__file__).parent / "threejs" / "style_shaders.mjs"
RAMPS = {"shading": "ramp", "ramp": "constant 0:0.1,0.1,0.4 0.2:0.5 0.6:1.4,0.9,0.7", "ramp_tint": 0.5, "highlights": "ramp",
         "highlight_ramp": "0:0 0.5:0.2 1:1"}
SURFACES = {
    "bands": {"bands": 4, "softness": 0.0, "shadow_amount": 0.6, "bleeding": 2.0},
    "channels": {"per_channel": True, "softness": 0.0, "highlights": "none"},
    "ramps": RAMPS,
    "rim": {"shading": "as_lit", "highlights": "as_lit", "rim_strength": 0.7, "rim_light": 0.5, "rim_width": 0.6,
            "rim_softness": 0.3, "rim_color": (1.0, 0.5, 0.2)},
}
AHEAD = """#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
#define HIGH_PRECISION
#define texture2D texture
uniform mat4 viewMatrix;
uniform bool isOrthographic;
uniform vec3 cameraPosition;
"""
VERTEX = AHEAD + """#define attribute in
#define varying out
uniform mat4 modelMatrix, modelViewMatrix, projectionMatrix;
uniform mat3 normalMatrix;
in vec3 position, normal;
in vec2 uv;
"""
FRAGMENT = AHEAD + """#define varying in
#define OPAQUE
layout(location = 0) out highp vec4 pc_fragColor;
#define gl_FragColor pc_fragColor
vec4 linearToOutputTexel(vec4 color) { return color; }
"""
LIGHT, AMBIENT, TOWARDS = np.float32([2.4, 1.8, 1.2]), np.float32([0.2, 0.5, 0.9]), np.float32([0.6, 0.0, 0.8])
ALBEDO = np.float32([0.8, 0.6, 0.3])


@pytest.fixture(scope="module")
def exported(kit_bundle, tmp_path_factory):
    """An export with a style, as a report."""
    settings = ExportSettings(style=EFFECT.Settings(**STYLES["ink_and_wash"]))
    return THREE.export(kit_bundle, tmp_path_factory.mktemp("style") / "out", settings)


@pytest.fixture(scope="module", params=["three", "three-oldest"])
def shaders(request, node, node_modules, exported):
    """What `style_shaders.mjs` prints, of the newest and the oldest three."""
    link = exported.out / "node_modules" / "three"
    link.parent.mkdir(exist_ok=True)
    link.unlink(missing_ok=True)
    link.symlink_to(node_modules / request.param, target_is_directory=True)
    ran = subprocess.run([node, SHADERS], capture_output=True, text=True, timeout=60, check=False,
                         env={**os.environ, "EXPORT": str(exported.out)})
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


@pytest.fixture(scope="module")
def bare():
    moderngl = pytest.importorskip("moderngl", reason="moderngl is not installed: it is for benchmarks")
    with current_context_kept():
        try:
            context = moderngl.create_context(standalone=True, backend="egl", require=430)
        except Exception as error:
            pytest.skip(f"no bare OpenGL context: {error}")
        yield context


def build(gl, shader):
    return gl.program(vertex_shader=VERTEX + shader["vertexShader"], fragment_shader=FRAGMENT + shader["fragmentShader"])


def texture(gl, values):
    values = np.ascontiguousarray(values, np.float32)
    made = gl.texture(values.shape[1::-1], 4, values.tobytes(), dtype="f4")
    made.filter = gl.LINEAR, gl.LINEAR
    return made


def ramps(gl, settings):
    """The picture of ramps as the file has it, decoded."""
    values = EFFECT.parameters(settings, Scene("empty"))
    both = np.stack([values["ramp"], values["highlight_ramp"]]) / ramp_scale(settings)
    return texture(gl, np.dstack([both, np.ones((*both.shape[:2], 1))]))


def give(program, **values):
    for name, value in values.items():
        if name in program:
            program[name].value = value


def draw(gl, program, size, corners, normals=None, uv=None, target=None):
    """RGBA (h, w, 4) of triangles with ``corners`` (n, 3), into ``target`` with a depth buffer if there is one."""
    arrays = {"position": (3, corners), "normal": (3, normals), "uv": (2, uv)}
    given = [(count, np.ascontiguousarray(values, np.float32), name) for name, (count, values) in arrays.items()
             if name in program and values is not None]
    vertices = gl.vertex_array(program, [(gl.buffer(values.tobytes()), f"{count}f", name) for count, values, name in given])
    frame = target or gl.framebuffer([gl.texture(size, 4, dtype="f4")], gl.depth_renderbuffer(size))
    frame.use()
    if target is None:
        frame.clear(0.0, 0.0, 0.0, 0.0)
    gl.enable_only(gl.DEPTH_TEST if normals is not None else gl.NOTHING)
    vertices.render()
    return frame, np.frombuffer(frame.read(components=4, dtype="f4"), np.float32).reshape(size[1], size[0], 4)


def style_uniforms(program, settings):
    give(program, **{f"style_{name}": value for name, value in surface_values(settings).items()}, style_ramps=0)


SCREEN = np.float32([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]])


def lit(gl, program, settings, size=(96, 96)):
    """A sheet with normals that turn as a ball's, under a sun and even light, and (n, 3) normals of its pixels."""
    style_uniforms(program, settings)
    ramps(gl, settings).use(0)
    turns = np.eye(4, dtype=np.float32).ravel()
    give(program, modelMatrix=tuple(turns), modelViewMatrix=tuple(turns), projectionMatrix=tuple(turns), viewMatrix=tuple(turns),
         normalMatrix=tuple(np.eye(3).ravel()), isOrthographic=True, diffuse=tuple(ALBEDO), opacity=1.0, emissive=(0.0,) * 3,
         specular=(0.3,) * 3, shininess=20.0, ambientLightColor=tuple(AMBIENT))
    give(program, **{"directionalLights[0].direction": tuple(TOWARDS), "directionalLights[0].color": tuple(LIGHT)})
    corners = SCREEN + np.float32([0.0, 0.0, 1.0])
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    _, image = draw(gl, program, size, SCREEN, corners)
    y, x = np.mgrid[0:size[1], 0:size[0]]
    shares = np.stack([(x + 0.5) / (2 * size[0]), (y + 0.5) / (2 * size[1])], axis=-1).reshape(-1, 2)
    normals = corners[0] + shares @ (corners[1:] - corners[0])
    return image[..., :3].reshape(-1, 3), (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("name", STYLES)
def test_every_value_of_a_style_has_its_uniform(name):
    text = (Path(engines.__file__).parent / "threejs/shaders/style_uniforms.glsl").read_text()
    declared = {line.split()[2].rstrip(";")[len("style_"):] for line in text.splitlines() if line.startswith("uniform")}
    assert set(surface_values(EFFECT.Settings(**STYLES[name]))) == declared - {"ramps"}


def test_a_style_comes_with_its_kit_and_its_losses(exported, kit_bundle, tmp_path):
    names = set(exported.files)
    assert {"rtgi/style.json", "rtgi/style_ramps.png", "rtgi/RTGIStyle.js", "rtgi/RTGIStyle.d.ts", "style.html",
            "conformance/style.js", "conformance/style/style.json", "conformance/style_picture.json"} <= names
    assert any("goes without marked edges, dots and strokes" in note for note in exported.notes)
    assert json.loads((exported.out / "demo.json").read_text())["style"] == "rtgi/style.json"
    assert "RTGIStyleView" in (exported.out / "README.md").read_text()
    plain = THREE.export(kit_bundle, tmp_path / "plain", ExportSettings())
    assert not any("tyle" in name for name in plain.files) and notes_on_style(None) == []


@pytest.mark.parametrize("release", ["three", "three-oldest"])
def test_what_the_style_promises(node, install_three, kit_bundle, tmp_path, release):
    folder = install_three(THREE.export(kit_bundle, tmp_path / "out", ExportSettings(style=DRAWN)).out, release)
    ran = subprocess.run([node, "--test", "--test-timeout=30000", SHADERS.with_name("style.test.mjs")], cwd=folder, check=False,
                         capture_output=True, text=True, timeout=120, env={**os.environ, "EXPORT": str(folder)})
    assert ran.returncode == 0 and "# pass 6" in ran.stdout, ran.stdout + ran.stderr


def test_every_shader_compiles(bare, shaders):
    for shader in shaders.values():
        build(bare, shader)


@pytest.mark.parametrize("name", SURFACES)
def test_materials_are_styled_as_the_effect_styles(bare, shaders, name):
    settings = EFFECT.Settings(**SURFACES[name])
    values = EFFECT.parameters(settings, Scene("empty"))
    found, normals = lit(bare, build(bare, shaders["lambert"]), settings)
    direct = LIGHT * np.maximum(normals @ TOWARDS, 0.0)[:, None]
    indirect = np.broadcast_to(AMBIENT, direct.shape)
    tone = luminance(direct + indirect) / np.float32(settings.key)
    total = direct + saturated(indirect, settings.bleeding)
    expected = ALBEDO / np.float32(np.pi) * shaded(total, tone, np.zeros_like(tone), values)
    if settings.rim_strength > 0:
        expected = expected + rim(normals[:, 2], luminance(direct) / np.float32(settings.key), values)
    off = np.abs(found - expected).max(axis=1)
    # A border between bands may fall on the other side by a rounding.
    assert np.mean(off > 2e-3) < 0.003 and np.median(off) < 1e-5 and expected.std() > 0.02


@pytest.mark.parametrize("highlights", ["band", "ramp", "none"])
def test_highlights_are_the_effects(bare, shaders, highlights):
    program = build(bare, shaders["phong"])
    plain = EFFECT.Settings(shading="as_lit", highlights="as_lit", highlight_ramp=RAMPS["highlight_ramp"], highlight_threshold=0.1)
    settings = replace(plain, highlights=highlights)
    below, _ = lit(bare, program, replace(plain, highlights="none"))
    shine = lit(bare, program, plain)[0] - below
    found = lit(bare, program, settings)[0] - below
    brightness = luminance(shine)
    assert brightness.max() > 0.15
    expected = _highlight(brightness, EFFECT.parameters(settings, Scene("empty")))
    expected = expected * shine / np.maximum(brightness, 1e-20)[:, None]
    seen = brightness > 1e-4
    assert np.abs(found - expected)[seen].max() < 5e-3


def line_pass(gl, shaders, surfaces, settings, picture=None, parallel=False, pixel_width=None):
    """The picture (h, w, 3) that the pass over the screen makes of ``surfaces`` (h, w, 4)."""
    size = surfaces.shape[1::-1]
    program = build(gl, shaders["lines"])
    style_uniforms(program, settings)
    view = still_life(True)[1]
    ramps(gl, settings).use(0)
    texture(gl, np.zeros((*surfaces.shape[:2], 4)) if picture is None else picture).use(1)
    texture(gl, surfaces).use(2)
    clip = np.asarray(view.clip_from_camera)
    give(program, picture=1, surfaces=2, parallel=parallel, pixelWidth=2.0 / (clip[0, 0] * size[0]),
         cameraFromClip=tuple(np.linalg.inv(clip).T.ravel()))
    _, image = draw(gl, program, size, SCREEN, uv=np.float32([[0, 0], [2, 0], [0, 2]]))
    return image[..., :3]


def surfaces_by_rays(apart=True):
    """What the pass draws of the still life, from numpy's G-buffer."""
    scene, view, coverage = still_life(apart)
    gbuffer = draw_gbuffer(light_context(scene, 1), view, SIZE)
    pose = np.asarray(view.world_from_camera)
    normal = gbuffer.normal[..., :3] @ pose[:3, :3]
    normal = normal / np.maximum(np.abs(normal).sum(axis=-1, keepdims=True), 1e-9)
    folded = (1 - np.abs(normal[..., 1::-1])) * np.where(normal[..., :2] < 0, -1.0, 1.0)
    depth = -(gbuffer.position[..., :3] - pose[:3, 3]) @ pose[:3, 2]
    flat = np.where(normal[..., 2:] < 0, folded, normal[..., :2])
    surfaces = np.dstack([flat, depth, 1024.0 * (1 + gbuffer.instance)])
    return np.where(gbuffer.seen[..., None], surfaces, 0.0).astype(np.float32), coverage


def test_lines_are_the_effects_own(bare, shaders):
    surfaces, expected = surfaces_by_rays()
    found = 1.0 - line_pass(bare, shaders, surfaces, DRAWN)[..., 0]
    assert expected.sum() > 700
    assert np.mean(np.abs(found - expected) > 1e-3) < 0.001


def test_what_is_drawn_of_surfaces_gives_those_lines(bare, shaders):
    """From triangles to lines, through three's own chunks: rasterization has its own mind of pixels on an edge."""
    scene, view, expected = still_life(True)
    program = build(bare, shaders["surfaces"])
    pose, clip = np.asarray(view.world_from_camera), np.asarray(view.clip_from_camera)
    look = np.linalg.inv(pose)
    give(program, modelMatrix=tuple(np.eye(4).ravel()), modelViewMatrix=tuple(look.T.ravel()), viewMatrix=tuple(look.T.ravel()),
         projectionMatrix=tuple(clip.T.ravel()), normalMatrix=tuple(look[:3, :3].T.ravel()), rtgiMaterial=0.0)
    target = None
    for number, mesh in enumerate(scene.meshes):
        corners = mesh.vertices_local[mesh.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.repeat(normals / np.linalg.norm(normals, axis=1, keepdims=True), 3, axis=0)
        give(program, rtgiObject=float(number))
        target, surfaces = draw(bare, program, SIZE, corners.reshape(-1, 3), normals, target=target)
    by_rays, _ = surfaces_by_rays()
    assert np.mean(surfaces[..., 3] != by_rays[..., 3]) < 0.005
    same = surfaces[..., 3] == by_rays[..., 3]
    assert np.median(np.abs(surfaces - by_rays)[same]) < 1e-4 and np.mean(np.abs(surfaces - by_rays)[same] > 1e-2) < 0.01
    found = 1.0 - line_pass(bare, shaders, surfaces, DRAWN)[..., 0]
    concerned = (found > 0.25) | (expected > 0.25)
    assert np.mean((np.abs(found - expected) > 0.25)[concerned]) < 0.05


def test_paper_and_grading_are_the_effects(bare, shaders):
    surfaces, _ = surfaces_by_rays()
    rng = np.random.default_rng(0)
    picture = np.dstack([rng.random((*surfaces.shape[:2], 3)), np.ones(surfaces.shape[:2])]).astype(np.float32)
    settings = EFFECT.Settings(shading="as_lit", lines=False, contrast=1.6, saturation=1.4, tint=(1.0, 0.9, 0.7),
                               paper_background=True, paper_color=(0.3, 0.2, 0.1))
    found = line_pass(bare, shaders, surfaces, settings, picture)
    seen = surfaces[..., 3] > 0
    expected = np.where(seen[..., None], picture, np.float32([0.3, 0.2, 0.1, 1.0]))
    expected = graded(expected, EFFECT.parameters(settings, Scene("empty")))[..., :3]
    assert np.abs(found - expected).max() < 2e-4
