"""The pre-flight finds each kind of trouble, names the object, and says nothing about sound scenes."""

from dataclasses import replace

import numpy as np
import pytest
from scene_builders import closed_box, cube, cube_furnace, integrating_sphere, material, open_plane, point_light, scene
from scene_builders import transform as moved
from scene_builders import volume as grid

from rtgi_addon.errors import BakeError
from rtgi_addon.scene import AreaLight, Channel, Instance, Material, Scene, Texture, World
from rtgi_addon.scene.checks import check_scene, require, scene_bounds
from rtgi_addon.scene.memory import estimate_bytes

IDENTITY = np.eye(4)


def found(checked, **options):
    """The findings of a scene as {(severity, object)} and their texts."""
    findings = check_scene(checked, **options)
    return {(finding.severity, finding.object) for finding in findings}, " | ".join(map(str, findings))


def with_vertices(checked, vertices):
    return replace(checked, meshes=(replace(checked.meshes[0], vertices_local=np.asarray(vertices, np.float32)),))


def with_matrix(checked, matrix):
    return replace(checked, instances=(replace(checked.instances[0], world_from_local=np.asarray(matrix, float)),))


def with_material(checked, **inputs):
    return replace(checked, materials=(replace(checked.materials[0], **inputs),))


@pytest.mark.parametrize("build", [closed_box, cube_furnace, integrating_sphere, open_plane])
def test_sound_scenes_are_clean(build):
    assert check_scene(build()) == []


def test_no_geometry():
    assert ("error", "test") in found(scene([], lights=[point_light()]))[0]
    empty = replace(cube(), triangles=np.empty((0, 3), np.int32), triangle_material=np.empty(0, np.int32))
    kinds, text = found(scene([empty], lights=[point_light()]))
    assert ("error", "test") in kinds and "no geometry" in text


def test_a_mesh_that_no_instance_shows_is_no_geometry():
    assert "no geometry" in found(replace(closed_box(), instances=()))[1]


def test_no_light():
    dark = replace(closed_box(), lights=())
    assert "no light" in found(dark)[1]
    assert "zero power" in found(replace(dark, lights=(point_light(intensity=0),)))[1]
    assert check_scene(replace(dark, world=World.constant(0.1))) == []
    assert check_scene(with_material(dark, emission=Channel.of(1.0))) == []


def test_an_emissive_material_counts_only_if_a_face_carries_it():
    lamp_shade = replace(closed_box(), lights=(), materials=(material(), material("unused glow", emission=5.0)))
    assert "no light" in found(lamp_shade)[1]
    overridden = replace(lamp_shade, instances=(Instance("room", 0, IDENTITY, material_override={0: 1}),))
    assert check_scene(overridden) == []


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_vertices_that_are_no_numbers(value):
    vertices = cube().vertices_local.copy()
    vertices[[2, 5], 1] = value
    kinds, text = found(with_vertices(closed_box(), vertices))
    assert ("error", "room") in kinds and "2 vertices" in text


def test_faces_without_area_are_counted():
    vertices = cube(inward=True).vertices_local.copy()
    vertices[1] = vertices[0]
    kinds, text = found(with_vertices(closed_box(), vertices))
    # Moving one corner of a cube into its neighbour flattens exactly the triangles with both.
    triangles = cube().triangles
    both = np.count_nonzero(np.any(triangles == 0, axis=1) & np.any(triangles == 1, axis=1))
    assert ("warning", "room") in kinds and f"{both} faces without area" in text


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e5])
def test_small_and_large_triangles_are_no_degenerates(size):
    text = found(with_vertices(closed_box(), cube().vertices_local * np.float32(size)))[1]
    assert "without area" not in text and "no face with an area" not in text


def test_faces_that_name_missing_vertices_or_materials():
    broken = replace(closed_box(), meshes=(replace(cube(), triangles=np.array([[0, 1, 99]], np.int32),
                                                   triangle_material=np.zeros(1, np.int32)),))
    assert ("error", "test") not in found(broken)[0] and "vertices it lacks" in found(broken)[1]
    wrong = replace(closed_box(), instances=(Instance("room", 0, IDENTITY, material_override={0: 7}),))
    assert "materials it lacks" in found(wrong)[1]


@pytest.mark.parametrize(("albedo", "expected"), [(0.999, False), (1.0, True), (1.2, True), ((0.2, 0.2, 1.0), True)])
def test_albedo_of_one_or_more(albedo, expected):
    kinds, text = found(with_material(closed_box(), albedo=Channel.of(albedo)))
    assert (("warning", "material wall") in kinds) == expected and ("reflects" in text) == expected


def test_white_texels_are_everyday_but_brighter_ones_are_not():
    byte = Texture("paper", np.full((2, 2, 3), 255, np.uint8), srgb=True)
    assert check_scene(with_material(closed_box(), albedo=Channel(texture=byte))) == []
    bright = Texture("bright", np.full((2, 2, 3), 1.5, np.float32))
    assert "reflects 1.5" in found(with_material(closed_box(), albedo=Channel(texture=bright)))[1]
    # What Principled makes of a texture: its layer's share is added to what that leaves of the base, and both are rounded.
    share = np.float32(0.0599)
    layered = Channel(constant=np.full(3, np.float32(1.0) - share + np.float32(6e-8)), texture=byte, offset=np.full(3, share))
    assert check_scene(with_material(closed_box(), albedo=layered)) == []


def test_material_values_that_are_no_light():
    nan = Channel.of(np.nan)
    assert ("error", "material wall") in found(with_material(closed_box(), albedo=nan))[0]
    assert ("error", "material wall") in found(with_material(closed_box(), emission=nan))[0]
    hole = np.ones((2, 2, 3), np.float32)
    hole[1, 1, 2] = np.nan
    assert "emission" in found(with_material(closed_box(), emission=Channel(texture=Texture("hole", hole))))[1]
    assert "negative emission" in found(with_material(closed_box(), emission=Channel.of(-1.0)))[1]
    assert "negative base colour" in found(with_material(closed_box(), albedo=Channel.of(-0.1)))[1]


def test_vertex_colours_enter_the_range():
    coloured = replace(cube(inward=True), attributes={"tint": np.full((12, 3, 4), 3.0, np.float32)})
    painted = replace(closed_box(), meshes=(coloured,), materials=(Material("wall", albedo=Channel(attribute="tint")),))
    assert "reflects 3" in found(painted)[1]


def test_matrices():
    kinds, text = found(with_matrix(closed_box(), moved(scale=(1, 1, 0))))
    assert ("warning", "room") in kinds and "flat along an axis" in text
    assert "scaled to nothing" in found(with_matrix(closed_box(), moved(scale=0)))[1]
    assert "flat" not in found(with_matrix(closed_box(), moved(scale=(1, -1, 1e-3))))[1]
    kinds, _ = found(with_matrix(closed_box(), np.full((4, 4), np.nan)))
    assert ("error", "room") in kinds


def test_where_float32_ends():
    assert "from the origin" in found(with_matrix(closed_box(), moved((1e5, 0, 0))))[1]
    assert "scale" in found(with_matrix(closed_box(), moved(scale=1e-5)))[1]
    assert "scale" in found(with_matrix(closed_box(), moved(scale=1e7)))[1]


def test_lamps():
    def lit(**changes):
        return replace(closed_box(), lights=(point_light(), replace(point_light(name="bad"), **changes)))

    assert ("error", "light bad") in found(lit(intensity=np.full(3, np.nan)))[0]
    assert ("error", "light bad") in found(lit(position_world=np.array([0, np.inf, 0])))[0]
    assert ("warning", "light bad") in found(lit(intensity=np.full(3, -1.0)))[0]
    flat = AreaLight("flat", np.zeros(3), np.zeros(3), np.array([0, 1.0, 0]), np.array([0, 0, -1.0]), np.ones(3))
    kinds, text = found(replace(closed_box(), lights=(flat,)))
    assert ("warning", "light flat") in kinds and "no light" in text


def test_world():
    nan = World(np.full((2, 4, 3), np.nan, np.float32))
    assert ("error", "world") in found(replace(closed_box(), world=nan))[0]
    assert ("warning", "world") in found(replace(closed_box(), world=World.constant(-1.0)))[0]


@pytest.mark.parametrize(("matrix", "resolution", "severity", "words"), [
    (moved(scale=(1, 0, 1)), (2, 2, 2), "error", "scaled to nothing"),
    (np.full((4, 4), np.inf), (2, 2, 2), "error", "NaN or infinity"),
    (IDENTITY, (2, 0, 2), "error", "2 × 0 × 2"),
    (moved((3, 0, 0)), (2, 2, 2), "warning", "outside"),
    (moved((2.5, 0, 0), scale=2), (2, 2, 2), None, ""),
])
def test_volumes(matrix, resolution, severity, words):
    placed = replace(grid("grid"), world_from_local=np.asarray(matrix, float), resolution=resolution)
    kinds, text = found(replace(closed_box(), volumes=(placed,)))
    assert kinds == ({(severity, "volume grid")} if severity else set()) and words in text


def test_a_turned_volume_beside_the_scene_is_outside_though_its_box_is_not():
    # World boxes overlap: only the volume's own axes show that the two are apart.
    angle = np.pi / 4
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    slab = replace(grid("slab"), world_from_local=moved((2.4, 2.4, 0), (0.1, 4, 1), turn))
    assert ("warning", "volume slab") in found(replace(closed_box(), volumes=(slab,)))[0]


def test_no_volume():
    assert "no probe volume" in found(replace(closed_box(), volumes=()))[1]


def test_memory_names_what_to_lower():
    huge = replace(closed_box(), volumes=(grid("grid", (2000, 2000, 2000)),))
    assert "resolution or the SH order" in found(huge)[1]
    assert "simplify its meshes" in found(integrating_sphere(), memory_bytes=4000)[1]
    assert check_scene(closed_box(), memory_bytes=2**30) == []
    assert estimate_bytes(huge, 4)["probes"] > estimate_bytes(huge, 2)["probes"]
    image = Texture("sky", np.zeros((64, 64, 3), np.float32))
    twice = (Material("a", albedo=Channel(texture=image)), Material("b", albedo=Channel(texture=image)))
    once = estimate_bytes(replace(closed_box(), materials=twice[:1]), 2)["textures"]
    assert estimate_bytes(replace(closed_box(), materials=twice), 2)["textures"] == once


def test_errors_come_first_and_stop_the_bake():
    both = replace(with_material(closed_box(), albedo=Channel.of(1.0)), lights=())
    findings = check_scene(both)
    assert [finding.severity for finding in findings] == ["error", "warning"]
    with pytest.raises(BakeError, match="no light") as caught:
        require(findings)
    assert caught.value.remedy
    require([finding for finding in findings if finding.severity == "warning"])


def test_a_shared_mesh_blames_its_first_instance_and_counts_the_rest():
    vertices = cube().vertices_local.copy()
    vertices[0] = np.nan
    shared = with_vertices(closed_box(), vertices)
    shared = replace(shared, instances=tuple(Instance(f"copy {i}", 0, moved((3 * i, 0, 0))) for i in range(4)))
    assert ("error", "copy 0 (and 3 more with its mesh)") in found(shared)[0]


def test_bounds_are_those_of_the_placed_geometry():
    placed = with_matrix(closed_box(), moved((1, 2, 3), (1, -2, 3)))
    assert np.allclose(scene_bounds(placed), [[0, 0, 0], [2, 4, 6]])
    assert scene_bounds(Scene("empty")) is None
