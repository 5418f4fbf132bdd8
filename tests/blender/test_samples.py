"""The sample files: they open cleanly, are what their table says, and can be made again."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.numerics import grid, sampling  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "sample_blends"
NAMES = sorted(path.stem for path in FOLDER.glob("*.blend"))
TABLE = {cells[0]: cells for cells in ([cell.strip() for cell in line.split("|")[1:-1]]
                                       for line in (FOLDER / "README.md").read_text(encoding="utf-8").splitlines()
                                       if line.startswith("| ") and "|" in line[2:]) if cells[0] in NAMES}


def open_sample(name):
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    return bpy.context.scene


def triangles(scene):
    return sum(len(scene.meshes[item.mesh].triangles) for item in scene.instances)


def test_the_table_lists_every_sample():
    assert sorted(TABLE) == NAMES and len(NAMES) == 18


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_small_and_ready_to_bake_and_to_look_at(name):
    path = FOLDER / f"{name}.blend"
    assert path.stat().st_size < 400_000
    assert path.read_bytes()[:4] == b"\x28\xb5\x2f\xfd", "saved uncompressed"
    scene = open_sample(name)
    assert scene.camera is not None and scene.render.engine == "CYCLES" and scene.view_settings.view_transform == "Standard"
    probes = {obj.data.type for obj in scene.objects if obj.type == "LIGHT_PROBE"}
    assert probes == ({"VOLUME", "SPHERE"} if name in {"wet_floor", "metal_shop"} else {"VOLUME"})
    assert not any(obj.visible_camera for obj in scene.objects if obj.type == "LIGHT")
    for image in bpy.data.images:
        assert image.packed_file is not None or image.name in {"not_there", "Render Result"}


@pytest.mark.parametrize("name", NAMES)
def test_the_table_says_how_big_a_sample_is(name):
    open_sample(name)
    scene = extract_scene()
    assert triangles(scene) == int(TABLE[name][1].replace(",", ""))
    (volume,) = scene.volumes
    assert "×".join(map(str, volume.resolution)) == TABLE[name][2]


@pytest.mark.parametrize("name", [name for name in NAMES if name != "adversarial"])
def test_a_sample_is_read_without_fallbacks(name):
    open_sample(name)
    scene = extract_scene()
    assert all(material.extraction == "nodes" for material in scene.materials)
    albedo = np.array([material.albedo.constant for material in scene.materials])
    assert (albedo >= 0).all() and (albedo <= 1).all()


@pytest.mark.parametrize("name", NAMES)
def test_no_two_objects_of_a_sample_show_a_face_in_one_place(name):
    """Two faces in one plane have no right picture: in Cycles each shadows the other, by rounding, which took 4 % of the light
    from the atrium's darkest corners and is no reference for anything."""
    open_sample(name)
    scene = extract_scene()
    context = LightContext(scene)
    geometry, (volume,) = context.geometry, scene.volumes
    points = grid.lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3)
    rng = np.random.default_rng(0)
    turns = np.linalg.qr(rng.standard_normal((len(points), 3, 3)))[0]
    sphere = sampling.fibonacci_sphere(max(64, 131072 // len(points)))
    directions = np.einsum("pij,kj->pki", turns, sphere).reshape(-1, 3).astype(np.float32)
    seen = context.tracer.intersect(np.repeat(points, len(sphere), axis=0).astype(np.float32), directions)
    hit = np.flatnonzero(seen.primitive >= 0)
    primitive, normals = seen.primitive[hit], geometry.normals_world[seen.primitive[hit]]
    places = geometry.points(primitive, seen.u[hit], seen.v[hit])
    step = np.float32(1e-3)
    for side in (step, -step):  # of two faces in one place the tracer may name either; from the other side it names the other
        again = context.tracer.intersect(places + side * normals, -np.sign(side) * normals)
        alike = np.einsum("ni,ni->n", geometry.normals_world[again.primitive], normals) > 0.9999
        there = (again.primitive >= 0) & (np.abs(again.t - step) < 0.02 * step) & alike
        other = there & (geometry.instance[again.primitive] != geometry.instance[primitive])
        names = {tuple(sorted(scene.instances[geometry.instance[index]].name for index in pair))
                 for pair in zip(primitive[other], again.primitive[other], strict=True)}
        assert there.sum() > 0.9 * len(hit) or side < 0
        assert not names


def test_the_atrium_is_big_by_modifiers_and_instances():
    scene = open_sample("atrium")
    kinds = {modifier.type for obj in bpy.data.objects for modifier in obj.modifiers}
    assert {"SUBSURF", "ARRAY", "SOLIDIFY", "NODES"} <= kinds
    assert sum(obj.instance_type == "COLLECTION" for obj in scene.objects) == 40
    stored = sum(len(mesh.polygons) for mesh in bpy.data.meshes)
    extracted = extract_scene()
    assert triangles(extracted) >= 250_000 > 30 * stored
    assert sum(len(mesh.triangles) for mesh in extracted.meshes) < triangles(extracted) / 3


def test_many_lights_are_two_hundred_of_three_kinds():
    scene = open_sample("many_lights")
    kinds = [obj.data.type for obj in scene.objects if obj.type == "LIGHT"]
    assert len(kinds) == 200 and {kind: kinds.count(kind) for kind in set(kinds)} == {"POINT": 80, "SPOT": 40, "AREA": 80}


@pytest.mark.slow
def test_the_builder_makes_every_sample_again(tmp_path):
    done = subprocess.run([sys.executable, FOLDER / "build.py", "--out", tmp_path], capture_output=True, text=True, timeout=300,
                          check=False)
    assert done.returncode == 0, done.stderr
    counts = dict(re.findall(r"^(\w+): ([\d,]+) triangles", done.stdout, re.MULTILINE))
    assert counts == {name: cells[1] for name, cells in TABLE.items()}


def test_the_builder_names_the_samples_it_knows():
    done = subprocess.run([sys.executable, FOLDER / "build.py", "cornel_box"], capture_output=True, text=True, timeout=60,
                          check=False)
    assert done.returncode == 2 and "cornell_box" in done.stderr
