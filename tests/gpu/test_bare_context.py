"""The same GLSL files in a bare OpenGL context, where moderngl is installed: they compile, and propagate as numpy does."""

from dataclasses import replace

import numpy as np
import pytest

moderngl = pytest.importorskip("moderngl", reason="moderngl is not installed: it is for benchmarks")

import scene_builders as build  # noqa: E402
from egl_contexts import current_context_kept  # noqa: E402
from probe_bakes import QUICK, bake  # noqa: E402
from receivers import directions, points_in  # noqa: E402
from scattered_rooms import scattered, storeys  # noqa: E402

from benchmarks.bare_gl import BareContext  # noqa: E402
from rtgi_addon.effects import registry as effects  # noqa: E402
from rtgi_addon.preview import programs  # noqa: E402
from rtgi_addon.preview.atlas import Atlas  # noqa: E402
from rtgi_addon.preview.effects import has_shader  # noqa: E402
from rtgi_addon.preview.effects.programs import pixel_program  # noqa: E402
from rtgi_addon.preview.indirect.lpv import lpv_tables  # noqa: E402
from rtgi_addon.preview.indirect.probes import probe_tables  # noqa: E402
from rtgi_addon.preview.indirect.rsm import rsm_tables  # noqa: E402
from rtgi_addon.preview.indirect.vpl import vpl_tables  # noqa: E402
from rtgi_addon.preview.packing import FLUX_SCALE, face_blocks, step_values  # noqa: E402
from rtgi_addon.preview.program import Program  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Scene  # noqa: E402
from rtgi_addon.techniques import get  # noqa: E402
from rtgi_addon.techniques.lattice.field import ProbeField  # noqa: E402
from rtgi_addon.techniques.lpv.geometry_volume import Surfels, face_blocking, inject_surfels  # noqa: E402
from rtgi_addon.techniques.lpv.grid import LpvGrid  # noqa: E402
from rtgi_addon.techniques.lpv.propagation import propagate  # noqa: E402

SMALL = {"probes": QUICK, "lpv": {"steps": 8, "map_resolution": 32, "cascades": 2}, "rsm": {"resolution": 32, "samples": 64},
         "vpl": {"lights": 200, "compensation": False}}
PROGRAMS = [value for value in vars(programs).values() if isinstance(value, Program)]
EFFECTS = [pixel_program(name, effect.parameters(effect.Settings(), Scene("empty"))) for name, effect in effects().items()
           if has_shader(name)]
SURFACES = [programs.surface_program(name, 2, 1, smooth) for name in programs.SURFACE_PASSES for smooth in (False, True)]
CHANNELS = ("red", "green", "blue")


@pytest.fixture(scope="module")
def bare():
    with current_context_kept():
        try:
            context = BareContext()
        except Exception as error:
            pytest.skip(f"no bare OpenGL context: {error}")
        yield context


@pytest.mark.parametrize("program", [*PROGRAMS, *EFFECTS, *SURFACES], ids=lambda program: program.name)
def test_every_program_compiles(bare, program):
    assert bare.build(program) is bare.build(program)


def test_one_step_of_light_is_numpys(bare):
    rng = np.random.default_rng(0)
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (6, 5, 7))
    normals = rng.normal(size=(200, 3))
    surfels = Surfels(rng.random((200, 3)) * grid.resolution, normals / np.linalg.norm(normals, axis=1, keepdims=True),
                      rng.random(200), rng.random((200, 3)))
    blocking, coefficients = face_blocking(inject_surfels(grid, surfels)), rng.normal(size=(4, 3, 7, 5, 6)).astype(np.float32)
    atlas = Atlas.of(grid.resolution)
    blocking = replace(blocking, kept=rng.random((2, 3, grid.count), np.float32))
    faces, blockers, kept = (bare.upload(texels) for texels in face_blocks(atlas, blocking))
    light = [bare.upload(atlas.pack(np.moveaxis(coefficients[:, channel], 0, -1) * FLUX_SCALE)) for channel in range(3)]
    following, total = ([bare.empty(*atlas.size) for _ in CHANNELS] for _ in range(2))
    bare.dispatch(
        programs.LPV_PROPAGATE, atlas.size,
        uniforms={"parameters": {**step_values(atlas, blocking), "accumulate": 1}},
        samplers={**{f"light_{name}": light[i] for i, name in enumerate(CHANNELS)}, "faces": faces, "blockers": blockers,
                  "kept": kept},
        images={f"{kind}_{name}": textures[i] for kind, textures in (("next", following), ("total", total))
                for i, name in enumerate(CHANNELS)})
    expected = propagate(coefficients, blocking, 1) - coefficients * blocking.area.reshape(grid.shape)
    for channel in range(3):
        found = np.moveaxis(atlas.unpack(bare.download(total[channel])) / FLUX_SCALE, -1, 0)
        assert np.abs(found - expected[:, channel]).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("name", SMALL)
def test_irradiance_is_the_fields(bare, name):
    scene = build.closed_box(albedo=0.6, light_position=(0.2, -0.3, 0.4))
    field = get(name).bake(scene, get(name).Settings(order=1, **SMALL[name]), np.random.default_rng(0), Progress())
    tables = {"probes": probe_tables, "lpv": lpv_tables, "rsm": rsm_tables, "vpl": vpl_tables}[name](field)
    held_to_numpy(bare, field, tables, points_in(0.8, 1024), directions(1024))


@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside a lattice"])
def test_scattered_probes_are_read_as_numpy_reads_them(bare, beside):
    grids = bake(scattered(storeys()), rays=64, cache_rays=16).grids()
    if beside:
        grids += bake(build.closed_box(half_size=0.7), rays=64, cache_rays=16).grids()
    field = ProbeField(grids)
    points = np.random.default_rng(0).uniform((-1.9, -1.9, -2.5), (1.9, 1.9, 2.5), (1024, 3))
    held_to_numpy(bare, field, probe_tables(field), points, directions(1024))


def held_to_numpy(bare, field, tables, points, normals):
    receivers = np.zeros((2, 32, 32, 4), np.float32)
    receivers[0, ..., :3], receivers[1, ..., :3] = points.reshape(32, 32, 3), normals.reshape(32, 32, 3)
    samplers = {sampler: bare.upload(texels) for sampler, texels in tables.textures.items()}
    target = bare.empty(32, 32)
    bare.dispatch(tables.program, (32, 32), uniforms={"frame": {"size": (32, 32)}, "indirect": tables.values},
                  samplers={"gbuffer_position": bare.upload(receivers[0]), "gbuffer_normal": bare.upload(receivers[1]), **samplers},
                  images={"irradiance": target})
    expected = field.irradiance(points, normals)
    difference = np.abs(bare.download(target)[..., :3].reshape(-1, 3) - expected).max(axis=1) / expected.max()
    assert np.quantile(difference, 0.98) < 2e-5 and difference.max() < 0.05
