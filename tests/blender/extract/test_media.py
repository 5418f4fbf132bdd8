"""Media as they are read: what nodes mean against Cycles' own renders of what shines through them, sampled nodes and grids, bad
input."""

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link  # noqa: E402
from fog_renders import Nodes, as_we_have_it, difference, filled_cube, needs_grids, shone_through, volume_material  # noqa: E402
from mathutils import Euler, Matrix  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.scene import Phase  # noqa: E402
from rtgi_addon.scene.medium import DRAINE, FOURNIER_FORAND, MIE, RAYLEIGH  # noqa: E402


def absorption(nodes):
    return nodes("VolumeAbsorption", Color=(0.9, 0.4, 0.1, 1), Density=0.7).outputs[0]


def principled(nodes):
    return nodes("VolumePrincipled", Color=(0, 0, 0, 1), Absorption_Color=(0.5, 0.2, 0.9, 1), Density=1.5, Emission_Strength=0.2,
                 Emission_Color=(1, 0.5, 0.2, 1)).outputs[0]


def hot(nodes):
    return nodes("VolumePrincipled", Color=(0, 0, 0, 1), Density=0.3, Blackbody_Intensity=1.0, Temperature=2600.0).outputs[0]


def coefficients(nodes):
    return nodes("VolumeCoefficients", Absorption_Coefficients=(0.1, 0.6, 0.3), Scatter_Coefficients=(0, 0, 0),
                 Emission_Coefficients=(0.3, 0.1, 0)).outputs[0]


def mixed(nodes):
    mix = nodes("MixShader", Fac=0.25)
    nodes.tree.links.new(absorption(nodes), mix.inputs[1])
    nodes.tree.links.new(nodes("Emission", Strength=0.8).outputs[0], mix.inputs[2])
    add = nodes("AddShader")
    nodes.tree.links.new(mix.outputs[0], add.inputs[0])
    nodes.tree.links.new(coefficients(nodes), add.inputs[1])
    return add.outputs[0]


def varying(kind):
    """Absorption whose density follows a coordinate."""
    def build(nodes):
        place = nodes("NewGeometry") if kind == "Position" else nodes("TexCoord")
        scaled = nodes("VectorMath", Vector=place.outputs[kind]).outputs[0]
        noise = nodes("TexNoise", Vector=scaled, Scale=0.7).outputs[0]
        return nodes("VolumeAbsorption", Color=(0.2, 0.5, 0.7, 1), Density=noise).outputs[0]
    return build


@pytest.mark.parametrize("build", [absorption, principled, hot, coefficients, mixed], ids=lambda build: build.__name__)
def test_nodes_mean_what_cycles_makes_of_them(empty_blend, build):
    filled_cube(build)
    seen, *rays = shone_through()
    assert difference(as_we_have_it(extract_scene(), *rays), seen) < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["Position", "Object", "Generated"])
def test_nodes_that_vary_are_sampled_by_cycles(empty_blend, kind):
    filled_cube(varying(kind))
    scene = extract_scene()
    medium, = scene.media
    assert medium.bounds is not None and max(medium.grid.resolution) == 64 and not scene.omissions
    assert any("differs from place to place, and is sampled on" in note for note in scene.notes)
    seen, *rays = shone_through()
    ours = as_we_have_it(scene, *rays)
    # Cycles' own noise at 64 samples is 2 to 3 % a pixel where density varies.
    assert difference(ours, seen) < 0.05 and ours.mean(axis=0) == pytest.approx(seen.mean(axis=0), rel=0.01)


def test_phase_functions_are_read_and_each_makes_a_medium(empty_blend):
    def build(nodes):
        total = None
        for phase, inputs in (("HENYEY_GREENSTEIN", {"Anisotropy": 0.3}), ("RAYLEIGH", {}), ("DRAINE", {"Alpha": 2.0}),
                              ("FOURNIER_FORAND", {"IOR": 1.2}), ("MIE", {"Diameter": 7.0}), ("RAYLEIGH", {"Density": 0.5})):
            node = nodes("VolumeScatter")
            node.phase = phase
            for name, value in inputs.items():
                node.inputs[name].default_value = value
            total = node.outputs[0] if total is None else added(nodes, total, node.outputs[0])
        return added(nodes, total, absorption(nodes))

    def added(nodes, first, second):
        node = nodes("AddShader")
        for out, into in zip((first, second), node.inputs, strict=True):
            nodes.tree.links.new(out, into)
        return node.outputs[0]

    filled_cube(build)
    media = extract_scene().media
    expected = [Phase(anisotropy=0.3), Phase(RAYLEIGH), Phase(DRAINE, alpha=2.0), Phase(FOURNIER_FORAND, ior=1.2),
                Phase(MIE, diameter=7.0)]
    assert [medium.phase.kind for medium in media] == [phase.kind for phase in expected]
    for medium, phase in zip(media, expected, strict=True):
        for name in ("anisotropy", "alpha", "ior", "backscatter", "diameter"):
            assert getattr(medium.phase, name) == pytest.approx(getattr(phase, name))
    assert media[1].scattering == pytest.approx([1.2] * 3) and media[0].absorption == pytest.approx([0.07, 0.42, 0.63])


def test_a_worlds_medium_fills_space(empty_blend):
    link("ground", cube_mesh())
    nodes = Nodes(bpy.data.worlds.new("mist"))
    bpy.context.scene.world = nodes.fill(nodes("VolumeScatter", Density=0.05).outputs[0])
    medium, = extract_scene().media
    assert medium.fills_space and medium.scattering == pytest.approx([0.04] * 3)


def test_instances_of_one_mesh_are_media_of_their_own(empty_blend):
    filled_cube(absorption)
    link("twin", bpy.data.objects["fog"].data, Matrix.Translation((5, 0, 0)))
    media = extract_scene().media
    assert [medium.name for medium in media] == ["fog", "twin"]
    assert media[0].bounds.triangles is media[1].bounds.triangles
    assert media[1].bounds.world_from_local[:3, 3].tolist() == [5, 0, 0]


def smoke(build=None, scale=0.5):
    """A VOLUME object whose grid 'density' is 2 + x over the cube [−1, 1]³ of its own space."""
    data = bpy.data.volumes.new("smoke")
    tree = bpy.data.node_groups.new("smoke", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    cube, axis, sum_ = (tree.nodes.new(kind) for kind in ("GeometryNodeVolumeCube", "ShaderNodeSeparateXYZ", "ShaderNodeMath"))
    last = cube.outputs[0]
    for start, end in ((tree.nodes.new("GeometryNodeInputPosition").outputs[0], axis.inputs[0]), (axis.outputs[0], sum_.inputs[0]),
                       (sum_.outputs[0], cube.inputs["Density"])):
        tree.links.new(start, end)
    sum_.inputs[1].default_value = 2.0
    if build is not None:
        painted = tree.nodes.new("GeometryNodeSetMaterial")
        painted.inputs["Material"].default_value = volume_material(build)
        tree.links.new(last, painted.inputs[0])
        last = painted.outputs[0]
    tree.links.new(last, tree.nodes.new("NodeGroupOutput").inputs[0])
    obj = link("smoke", data, Matrix.LocRotScale((0.1, 0, 0), Euler((0, 0, 0.4)), (scale, scale, scale)))
    obj.modifiers.new("smoke", "NODES").node_group = tree
    link("far", cube_mesh("far", 0.1), Matrix.Translation((40, 0, -50)))
    return obj


def black(nodes):
    return nodes("VolumePrincipled", Color=(0, 0, 0, 1), Density=0.5).outputs[0]


def by_attribute(nodes):
    grid = nodes("Attribute")
    grid.attribute_name = "density"
    doubled = nodes("Math")
    doubled.operation = "MULTIPLY"
    nodes.tree.links.new(grid.outputs["Fac"], doubled.inputs[0])
    doubled.inputs[1].default_value = 0.3
    return nodes("VolumeAbsorption", Color=(0, 0.5, 0.2, 1), Density=doubled.outputs[0]).outputs[0]


@needs_grids
@pytest.mark.parametrize("build", [black, by_attribute])
def test_grids_of_volumes_are_read_with_what_their_nodes_make_of_them(empty_blend, build):
    smoke(build)
    seen, *rays = shone_through()
    ours = as_we_have_it(extract_scene(), *rays)
    # The outermost half voxel fades there and ends here, and Cycles has noise.
    assert difference(ours, seen) < 0.06 and ours.mean(axis=0) == pytest.approx(seen.mean(axis=0), rel=0.01)


@needs_grids
def test_a_volume_without_a_material_is_what_cycles_gives_it(empty_blend):
    smoke()
    medium, = extract_scene().media
    assert medium.scattering == pytest.approx(medium.absorption)
    density = medium.grid.density[16, 16] * medium.extinction[0]
    # Twice as dense, since it is half as large: 1 at one end of its own space, 3 at the other.
    assert density[[0, -1]] == pytest.approx([2.0, 6.0], rel=1e-3)


@needs_grids
def test_a_grid_of_too_many_cells_is_read_coarser_and_said_so(empty_blend, monkeypatch):
    monkeypatch.setattr("rtgi_addon.blender.extract.media.MOST_CELLS", 1000)
    smoke()
    scene = extract_scene()
    assert scene.media[0].grid.density.size <= 12**3
    assert any(note.startswith("the grids of smoke are read on") for note in scene.notes)


def test_what_cannot_be_read_is_one_line_that_names_the_object(empty_blend):
    open_mesh = cube_mesh("open")
    kept = [polygon.vertices[:] for polygon in open_mesh.polygons][1:]
    open_mesh.clear_geometry()
    open_mesh.from_pydata([vertex.co for vertex in cube_mesh().vertices], [], kept)
    filled_cube(absorption, mesh=open_mesh)
    gone = bpy.data.volumes.new("gone")
    gone.filepath = "//nowhere.vdb"
    link("gone", gone)
    link("empty", bpy.data.volumes.new("empty"))
    scene = extract_scene()
    assert scene.media == ()
    said = [str(omission) for omission in scene.omissions]
    for words in ("fog has the volume of material 'fog' within a surface that is not closed",
                  "file //nowhere.vdb is missing, and with it gone", "empty is a volume without grids"):
        assert len([line for line in said if words in line]) == 1, said
    assert all(omission.objects for omission in scene.omissions if "volume" in omission.text)


def test_what_volumes_see_of_lamps_and_objects(empty_blend):
    filled_cube(lambda nodes: nodes("VolumeScatter", Density=0.5).outputs[0])
    for name, factor, seen in (("plain", 1.0, True), ("faint", 0.25, True), ("hidden", 0.5, False)):
        data = bpy.data.lights.new(name, "POINT")
        data.energy, data.volume_factor = 10.0, factor
        link(name, data, Matrix.Translation((0, 0, 3))).visible_volume_scatter = seen
    bpy.data.objects["far"].visible_volume_scatter = False
    alone = link("alone", cube_mesh("alone", 0.1), Matrix.Translation((2, 0, 0)))
    alone.visible_camera = alone.visible_diffuse = alone.visible_shadow = False
    scene = extract_scene()
    assert [omission.objects for omission in scene.omissions if "to volume scatter rays alone" in omission.text] == [("alone",)]
    assert scene.omissions[0].boxes_world is not None
    assert {light.name: light.scattered for light in scene.lights} == {"plain": 1.0, "faint": 0.25, "hidden": 0.0}
    assert any("lamp faint: its influence on volumes, 0.25, is followed" in note for note in scene.notes)
    assert any(note.startswith("far is hidden from volume scatter") for note in scene.notes)
    assert [item.name for item in scene.instances if not item.visible_scatter] == ["far"]
    bpy.data.objects["fog"].data.materials.clear()
    scene = extract_scene()
    assert not scene.omissions and not any("influence" in note or "volume scatter" in note for note in scene.notes)
