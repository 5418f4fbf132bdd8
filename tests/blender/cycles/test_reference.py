"""Probes rendered by Cycles: right about a known world, the same by both methods, and the scene left as it was."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")

from cycles_scenes import everything, grade_world, lamp_in_a_box  # noqa: E402

from rtgi_addon.blender.cycles import reference as cycles_reference  # noqa: E402
from rtgi_addon.blender.cycles.reference import (  # noqa: E402
    CyclesSettings,
    octahedral_directions,
    points_in_the_open,
    render_probes,
    volume_points,
)
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.numerics import sh  # noqa: E402

METHODS = ["panorama"] + (["tiles"] if bpy.app.build_options.cycles_osl else [])


@pytest.fixture
def graded_world(empty_blend):
    """See grade_world."""
    return grade_world(bpy.context.scene)


@pytest.mark.parametrize("method", METHODS)
def test_directions_are_those_of_the_world(graded_world, method):
    result = render_probes([(0, 0, 0), (3.0, -2.0, 1.0)], CyclesSettings(samples=4, resolution=64, method=method))
    exact = np.zeros((4, 3))
    exact[0] = np.sqrt(4 * np.pi)
    exact[[3, 1, 2], [0, 1, 2]] = np.sqrt(4 * np.pi / 3)
    assert result["method"] == method
    assert np.allclose(result["sh"][:, :4], exact, atol=4e-3)
    assert np.allclose(result["sh"][:, 4:], 0.0, atol=4e-3)


def test_both_methods_agree_in_a_lit_box_and_hide_the_lamp(empty_blend):
    if "tiles" not in METHODS:
        pytest.skip("this Blender was built without OSL")
    scene = bpy.context.scene
    lamp_in_a_box(scene)
    points = [(0.0, 0.0, 0.0), (-0.5, 0.4, -0.3)]
    tiles, panorama = (render_probes(points, CyclesSettings(samples=8, seeds=3, resolution=64, method=method))
                       for method in ("tiles", "panorama"))
    noise = np.sqrt((tiles["variance"] + panorama["variance"]).sum(axis=(1, 2)))
    difference, size = (np.linalg.norm(values, axis=(1, 2)) for values in (tiles["sh"] - panorama["sh"], tiles["sh"]))
    assert (difference < 4 * noise + 2e-3 * size).all()
    # Seen directly, the lamp of 0.2 m would add 40 / (4π · π · 0.2²) over a solid angle of about 0.4 sr at the first point.
    assert tiles["sh"][0, 0].max() < 40.0


def test_a_lamp_in_an_instanced_collection_is_hidden_too(empty_blend):
    scene = bpy.context.scene
    lamp = lamp_in_a_box(scene)
    scene.collection.objects.unlink(bpy.data.objects["Cube"])
    collection = bpy.data.collections.new("Fitting")
    scene.collection.objects.unlink(lamp)
    collection.objects.link(lamp)
    empty = bpy.data.objects.new("Placed", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    scene.collection.objects.link(empty)
    assert not render_probes([(0, 0, 0)], CyclesSettings(samples=4, resolution=16))["sh"].any()
    assert lamp.visible_camera


def test_a_point_is_rendered_where_it_was_asked_for(empty_blend):
    """One emissive panel under many probes: each sees it under its own angle, in its own tile."""
    bpy.ops.mesh.primitive_plane_add(size=0.5)
    glow = bpy.data.materials.new("Glow")
    if glow.node_tree is None:
        glow.use_nodes = True
    bsdf = next(node for node in glow.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    bsdf.inputs["Emission Color"].default_value, bsdf.inputs["Emission Strength"].default_value = (1, 1, 1, 1), 3.0
    bsdf.inputs["Base Color"].default_value, bsdf.inputs["Specular IOR Level"].default_value = (0, 0, 0, 1), 0.0
    bpy.context.object.data.materials.append(glow)
    rng = np.random.default_rng(1)
    points = rng.uniform((-1.5, -1.5, 0.6), (1.5, 1.5, 2.0), (7, 3))
    measured = render_probes(points, CyclesSettings(samples=16, resolution=128))["sh"][:, 0, 0]
    x = (np.arange(200) + 0.5) / 200 * 0.5 - 0.25
    panel = np.stack((*np.meshgrid(x, x), np.zeros((200, 200))), axis=-1).reshape(-1, 3)
    away = points[:, None] - panel
    distance = np.linalg.norm(away, axis=-1)
    solid_angle = (away[..., 2] / distance**3).sum(axis=1) * (0.5 / 200) ** 2
    assert np.allclose(measured, 3.0 * solid_angle * 0.282095, rtol=0.02)


@pytest.mark.parametrize("method", METHODS)
def test_the_scene_is_put_back(empty_blend, method):
    scene = bpy.context.scene
    lamp_in_a_box(scene)
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_depth = "16"
    scene.render.resolution_x, scene.render.film_transparent, scene.render.filepath = 123, True, "//somewhere"
    scene.render.engine = "BLENDER_WORKBENCH"
    before = everything(scene)
    render_probes([(0, 0, 0)], CyclesSettings(samples=1, resolution=16, method=method))
    assert everything(scene) == before


def test_the_scene_is_put_back_after_a_failure(empty_blend, monkeypatch):
    scene = bpy.context.scene
    lamp_in_a_box(scene)
    before = everything(scene)

    def fail(*_):
        raise RuntimeError("the disk is full")

    monkeypatch.setattr(cycles_reference, "render_picture", fail)
    with pytest.raises(RuntimeError, match="disk"):
        render_probes([(0, 0, 0)], CyclesSettings(samples=1, resolution=16))
    assert everything(scene) == before


def test_seeds_give_the_variance_of_their_mean(empty_blend):
    lamp_in_a_box(bpy.context.scene)
    many = render_probes([(0, 0, 0)], CyclesSettings(samples=1, resolution=16, seeds=8))
    one = render_probes([(0, 0, 0)], CyclesSettings(samples=1, resolution=16))
    again = render_probes([(0, 0, 0)], CyclesSettings(samples=1, resolution=16))
    assert np.isnan(one["variance"]).all() and (one["sh"] == again["sh"]).all()
    assert (many["variance"] >= 0).all() and many["variance"].max() > 0
    assert np.linalg.norm(one["sh"] - many["sh"]) < 8 * np.sqrt(8 * many["variance"].sum())


def test_octahedral_directions_share_the_sphere_evenly():
    side = 64
    centre = (np.arange(side) + 0.5) / side * 2 - 1
    directions = octahedral_directions(np.stack(np.meshgrid(centre, centre), axis=-1).reshape(-1, 2))
    assert np.allclose(np.linalg.norm(directions, axis=1), 1)
    gram = sh.evaluate(directions, 3).astype(float)
    assert np.allclose(gram.T @ gram * (4 * np.pi / side**2), np.eye(16), atol=2e-3)


def test_volume_points_are_cell_centred_and_x_runs_fastest(empty_blend):
    data = bpy.data.lightprobes.new("Volume", "VOLUME")
    data.resolution_x, data.resolution_y, data.resolution_z = 2, 3, 4
    volume = bpy.data.objects.new("Volume", data)
    bpy.context.scene.collection.objects.link(volume)
    volume.scale, volume.location = (1.0, 3.0, 4.0), (10.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    points = volume_points(bpy.context.scene)
    assert points.shape == (24, 3)
    assert np.allclose(points[:3], [(9.5, -2.0, -3.0), (10.5, -2.0, -3.0), (9.5, 0.0, -3.0)])
    assert np.allclose(points[6], (9.5, -2.0, -1.0))


def test_points_in_the_open_keep_clear_of_solids_and_of_one_another(empty_blend):
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    x = np.linspace(-3.0, 3.0, 25)
    points = np.stack((x, np.zeros(25), np.zeros(25)), axis=1)
    chosen = points_in_the_open(bpy.context.scene, points, 0.3, 25)
    assert np.array_equal(chosen, np.flatnonzero(np.abs(x) >= 1.3))
    pair = points_in_the_open(bpy.context.scene, points, 0.3, 2)
    assert x[pair].tolist() == [-3.0, 3.0]
    with pytest.raises(BakeError, match="no point"):
        points_in_the_open(bpy.context.scene, points, 9.0, 2)
