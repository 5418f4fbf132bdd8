"""The volume of a world that differs from place to place: sampled around the scene as its nodes say, and as Cycles has it."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link  # noqa: E402
from fog_renders import GLOW, Nodes, as_we_have_it, shone_through  # noqa: E402
from mathutils import Matrix  # noqa: E402

from rtgi_addon.blender.extract import extract_scene, media  # noqa: E402
from rtgi_addon.numerics.grid import lattice_points  # noqa: E402


@pytest.fixture(autouse=True)
def few_cells(monkeypatch):
    """Enough for what is linear between them."""
    monkeypatch.setattr(media, "WORLD_CELLS", 12)


def foggy(build):
    """A scene between (-2, -1, -1) and (4, 1, 1) whose world ``build(nodes)`` fills, extracted."""
    link("left", cube_mesh(), Matrix.Translation((-1, 0, 0)))
    link("right", cube_mesh("right"), Matrix.Translation((3, 0, 0)))
    nodes = Nodes(bpy.data.worlds.new("mist"))
    bpy.context.scene.world = nodes.fill(build(nodes))
    return extract_scene()


def gradient(kind):
    """Absorption that grows with x from 0 on, by a texture whose vector is a coordinate, or none."""
    def build(nodes):
        ramp = nodes("TexGradient") if kind is None else nodes("TexGradient", Vector=nodes("TexCoord").outputs[kind])
        return nodes("VolumeAbsorption", Color=(0, 0.5, 0.75, 1), Density=ramp.outputs[0]).outputs[0]
    return build


@pytest.mark.parametrize("kind", [None, "Generated", "Object"])
def test_coordinates_are_places_in_the_world(empty_blend, kind):
    scene = foggy(gradient(kind))
    medium, = scene.media
    assert medium.bounds is None and medium.grid.resolution == (12, 4, 4) and medium.name == "world 'mist'"
    assert not scene.omissions
    note, = (note for note in scene.notes if "'mist'" in note)
    assert "12 × 4 × 4 cells of 0.5 m" in note and "beyond (-2, -1, -1) to (4, 1, 1)" in note
    x = lattice_points(medium.grid.world_from_local, (12, 4, 4))[..., 0]
    found = medium.grid.density[..., None] * medium.absorption
    assert np.allclose(found, np.clip(x, 0, 1)[..., None] * (1.0, 0.5, 0.25), atol=2e-3)


def test_ramps_curves_and_groups_are_taken_along(empty_blend):
    def build(nodes):
        group = bpy.data.node_groups.new("dense", "ShaderNodeTree")
        group.interface.new_socket("x", in_out="INPUT", socket_type="NodeSocketFloat")
        group.interface.new_socket("Fog", in_out="OUTPUT", socket_type="NodeSocketShader")
        start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        scatter = group.nodes.new("ShaderNodeVolumeScatter")
        scatter.inputs["Color"].default_value = (1, 1, 1, 1)
        group.links.new(start.outputs[0], scatter.inputs["Density"])
        group.links.new(scatter.outputs[0], end.inputs[0])
        separate = nodes("SeparateXYZ", Vector=nodes("NewGeometry").outputs["Position"])
        shifted = nodes("Math")
        shifted.operation = "MULTIPLY_ADD"
        nodes.tree.links.new(separate.outputs[0], shifted.inputs[0])
        shifted.inputs[1].default_value, shifted.inputs[2].default_value = 0.125, 0.5
        ramp = nodes("ValToRGB", Fac=shifted.outputs[0])
        ramp.color_ramp.elements[1].position, ramp.color_ramp.elements[1].color = 0.75, (0.5, 0.5, 0.5, 1)
        ramp.color_ramp.elements.new(1.0).color = (1, 1, 1, 1)
        curve = nodes("RGBCurve", Color=ramp.outputs[0])
        points = curve.mapping.curves[3].points
        points[0].location, points[1].location = (0, 0.2), (1, 0.8)
        curve.mapping.update()
        node = nodes("Group")
        node.node_tree = group
        nodes.tree.links.new(curve.outputs[0], node.inputs[0])
        return node.outputs[0]

    medium, = foggy(build).media
    place = 0.125 * lattice_points(medium.grid.world_from_local, (12, 4, 4))[..., 0] + 0.5
    expected = 0.2 + 0.6 * np.interp(place, [0, 0.75, 1], [0, 0.5, 1])
    assert np.allclose(medium.grid.density * medium.scattering[0], expected, atol=0.01)
    assert len(bpy.data.materials) == 0 and len(bpy.data.node_groups) == 1


def test_what_cycles_sees_through_it_is_what_we_have(empty_blend):
    def build(nodes):
        separate = nodes("SeparateXYZ", Vector=nodes("TexCoord").outputs["Generated"])
        return nodes("VolumeAbsorption", Color=(0.98, 0.95, 0.9, 1), Density=separate.outputs[2]).outputs[0]

    # A glowing floor, its top at z = -1, and a roof above the camera: what is between them is seen through.
    floor, glow = cube_mesh("floor"), Nodes(bpy.data.materials.new("glow"))
    floor.materials.append(glow.fill(glow("Emission", Color=(*GLOW, 1), Strength=1.0).outputs[0], "Surface"))
    link("floor", floor, Matrix.Translation((0, 0, -2)) @ Matrix.Diagonal((4, 4, 1, 1)))
    link("roof", cube_mesh("roof"), Matrix.Translation((0, 0, 8)) @ Matrix.Diagonal((0.1, 0.1, 1, 1)))
    nodes = Nodes(bpy.data.worlds.new("mist"))
    bpy.context.scene.world = nodes.fill(build(nodes))
    read = extract_scene()
    seen, *rays = shone_through(4, build)
    ours = as_we_have_it(read, *rays, reach=6.0)
    # Up to z = 5 from where density begins, at 0.
    exact = np.array(GLOW) * np.exp(-12.5 * np.array([0.02, 0.05, 0.1]))
    assert ours == pytest.approx(np.tile(exact, (16, 1)), rel=0.02)
    assert seen.mean(axis=0) == pytest.approx(exact, rel=0.02)


def test_what_cannot_be_read_is_named(empty_blend, monkeypatch):
    monkeypatch.setattr("rtgi_addon.blender.extract.extract.bounds_of", lambda *parts: None)
    scene = foggy(gradient(None))
    assert not scene.media and "nothing to sample it around" in scene.omissions[0].text
    assert np.isinf(scene.omissions[0].boxes_world).all()
