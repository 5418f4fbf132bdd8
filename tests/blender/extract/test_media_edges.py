"""Media at the edges of what there is: files of OpenVDB, whole, damaged and gone; grids that are too large, negative or no numbers;
cold bodies; hidden objects."""

import os

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link  # noqa: E402
from fog_renders import GLOW, Nodes, as_we_have_it, filled_cube, needs_grids, shone_through  # noqa: E402
from mathutils import Matrix  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.extract.extract import files_of_blend  # noqa: E402
from rtgi_addon.blender.extract.lattice import sampled_grids  # noqa: E402
from rtgi_addon.transport.media.table import MediaTable  # noqa: E402

needs_usd = pytest.mark.skipif(not bpy.app.build_options.usd, reason="this Blender writes no .vdb: it is built without USD")


def grown(name, density, resolution=16):
    """A VOLUME object over [−1, 1]³ whose geometry nodes make 'density' as ``density(tree, x)`` gives it, x a socket."""
    obj = link(name, bpy.data.volumes.new(name))
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    cube = tree.nodes.new("GeometryNodeVolumeCube")
    for axis in "XYZ":
        cube.inputs[f"Resolution {axis}"].default_value = resolution
    place, axes = tree.nodes.new("GeometryNodeInputPosition"), tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(place.outputs[0], axes.inputs[0])
    tree.links.new(density(tree, axes.outputs[0]), cube.inputs["Density"])
    tree.links.new(cube.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    obj.modifiers.new(name, "NODES").node_group = tree
    return obj


def calculated(operation, value):
    """A density by one operation on x."""
    def density(tree, x):
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        tree.links.new(x, node.inputs[0])
        node.inputs[1].default_value = value
        return node.outputs[0]
    return density


@pytest.fixture
def vdb(floor, tmp_path):
    """A file of OpenVDB of 2 + x over [−1, 1]³, as Blender itself writes it beside USD."""
    grown("smoke", calculated("ADD", 2.0))
    bpy.ops.wm.usd_export(filepath=str(tmp_path / "smoke.usda"))
    file, = tmp_path.rglob("*.vdb")
    bpy.data.objects.remove(bpy.data.objects["smoke"])
    return file


def from_file(path, name="smoke"):
    data = bpy.data.volumes.new(name)
    data.filepath = str(path)
    return link(name, data, Matrix.Translation((1, 0, 0)))


@pytest.fixture(autouse=True)
def floor(empty_blend):
    """Something to fit probes to."""
    link("floor", cube_mesh("floor", 0.1))


def lines_about(scene, name):
    return [str(omission) for omission in scene.omissions if name in omission.objects]


@needs_grids
@needs_usd
def test_a_file_of_openvdb_is_read(vdb):
    from_file(vdb)
    medium, = extract_scene().media
    density = medium.grid.density * medium.extinction[0]
    nz, ny, nx = density.shape
    x = medium.grid.world_from_local[0, 0] * ((np.arange(nx) + 0.5) * 2 / nx - 1) + medium.grid.world_from_local[0, 3] - 1
    inner = slice(2, -2)
    assert np.abs(density[nz // 2, ny // 2, inner] - (2 + x[inner])).max() < 0.01


@needs_grids
@needs_usd
@pytest.mark.parametrize(("damage", "words"), [
    ("cut", "cannot be read (the values of density are damaged)"), ("text", "is a volume whose file cannot be read ("),
    ("gone", "Volume.vdb is missing, and with it")])
def test_a_file_that_is_none_is_one_line_that_names_the_object(vdb, damage, words):
    if damage == "gone":
        os.remove(vdb)
    else:
        # Cut within its first header, such a file ends Blender itself.
        vdb.write_bytes(vdb.read_bytes()[:1500] if damage == "cut" else b"no volume at all\n" * 40)
    from_file(vdb)
    scene = extract_scene()
    said = lines_about(scene, "smoke")
    assert scene.media == () and len(said) == 1 and words in said[0] and "\n" not in said[0]


@needs_grids
def test_a_grid_that_is_negative_or_no_number_counts_as_nothing_there_and_is_said(empty_blend, monkeypatch):
    grown("cold", calculated("ADD", -0.2))

    def with_no_number(*asked):
        grids = sampled_grids(*asked)
        if asked[0].name == "odd":
            grids["density"][:8] = [np.nan, np.inf] * 4
        return grids

    monkeypatch.setattr("rtgi_addon.blender.extract.media.sampled_grids", with_no_number)
    grown("odd", calculated("ADD", 2.0))
    scene = extract_scene()
    cold, = (medium for medium in scene.media if medium.name == "cold")
    assert cold.grid.density.min() == 0 and (cold.grid.density == 0).mean() > 0.4
    assert len([note for note in scene.notes if "'density' of cold is negative in places" in note]) == 1
    odd, = (medium for medium in scene.media if medium.name == "odd")
    assert np.all(odd.grid.density.ravel()[:8] == 0) and np.all(odd.grid.density.ravel()[8:] > 0)
    assert len([note for note in scene.notes if "of odd has values at NaN or infinity" in note]) == 1, scene.notes


@needs_grids
def test_a_grid_with_nothing_in_it_is_one_line(empty_blend):
    grown("none", calculated("MULTIPLY", 0.0))
    scene = extract_scene()
    said = lines_about(scene, "none")
    assert scene.media == () and len(said) == 1 and "is a volume with nothing in it" in said[0]


@needs_grids
def test_a_thousand_million_cells_are_read_coarser(empty_blend, monkeypatch):
    """Two puffs a hundred metres apart, of voxels of ten centimetres: few are stored, and 10⁹ lie between them."""
    monkeypatch.setattr("rtgi_addon.blender.extract.media.MOST_CELLS", 1 << 15)
    mesh = bpy.data.meshes.new("two")
    mesh.from_pydata([(0, 0, 0), (100, 100, 100)], [], [])
    source = link("two", mesh)
    obj = link("puffs", bpy.data.volumes.new("puffs"))
    tree = bpy.data.node_groups.new("puffs", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    info, points, fill = (tree.nodes.new(f"GeometryNode{kind}") for kind in ("ObjectInfo", "MeshToPoints", "PointsToVolume"))
    info.inputs["Object"].default_value = source
    mode = fill.inputs.get("Resolution Mode")
    if mode is not None:
        mode.default_value = "Size"
    else:
        fill.resolution_mode = "VOXEL_SIZE"
    fill.inputs["Voxel Size"].default_value, fill.inputs["Radius"].default_value = 0.1, 1.0
    tree.links.new(info.outputs["Geometry"], points.inputs[0])
    tree.links.new(points.outputs[0], fill.inputs[0])
    tree.links.new(fill.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    obj.modifiers.new("puffs", "NODES").node_group = tree
    scene = extract_scene()
    note, = (note for note in scene.notes if note.startswith("the grids of puffs are read on"))
    assert float(note.split()[-6]) > 25, note
    assert all(medium.grid.density.size <= 1.2 * (1 << 15) for medium in scene.media)


@pytest.mark.parametrize("kelvin", [900.0, 1300.0, 1800.0])
def test_cold_bodies_glow_as_they_do_in_cycles(empty_blend, kelvin):
    """Redder than a display shows: of blue, and below 1,000 K of green, Cycles takes for it, and here there is none."""
    def cold(nodes):
        return nodes("VolumePrincipled", Color=(0, 0, 0, 1), Density=0.3, Blackbody_Intensity=4.0, Temperature=kelvin).outputs[0]

    filled_cube(cold)
    seen, *rays = shone_through()
    scene = extract_scene()
    ours, theirs = as_we_have_it(scene, *rays).mean(axis=0), seen.mean(axis=0)
    assert ours[0] == pytest.approx(theirs[0], rel=5e-3) and ours[1] == pytest.approx(theirs[1], rel=0.03)
    dark = (MediaTable(scene.media).transmittance(*rays, np.full(len(rays[0]), 20.0)) * GLOW).mean(axis=0)
    assert ours[2] == pytest.approx(dark[2], rel=1e-5) and theirs[2] < ours[2]
    assert len([note for note in scene.notes if "redder than colours of the scene can be" in note]) == 1


def test_hidden_objects_media_say_from_what(empty_blend):
    def fog(nodes):
        return nodes("VolumeScatter", Density=1.0).outputs[0]

    for name, flag in (("a", "visible_camera"), ("b", "visible_diffuse"), ("c", "visible_shadow")):
        obj = filled_cube(fog, mesh=cube_mesh(name))
        obj.name = name
        setattr(obj, flag, False)
    found = {medium.name: medium for medium in extract_scene().media}
    for name, flag in (("a", "visible_camera"), ("b", "visible_diffuse"), ("c", "visible_shadow")):
        flags = {kind: getattr(found[name], kind) for kind in ("visible_camera", "visible_diffuse", "visible_shadow")}
        assert flags == {kind: kind != flag for kind in flags}


def test_a_world_that_glows_alone_is_refused_before_any_ray(empty_blend):
    from rtgi_addon.scene.checks import check_scene
    link("floor", cube_mesh())
    nodes = Nodes(bpy.data.worlds.new("glow"))
    bpy.context.scene.world = nodes.fill(nodes("Emission", Strength=0.4).outputs[0])
    scene = extract_scene()
    medium, = scene.media
    assert np.allclose(medium.emission, 0.4) and not medium.extinction.any()
    said = [finding for finding in check_scene(scene) if finding.object == medium.name]
    assert len(said) == 1 and said[0].severity == "error" and "takes none of it" in said[0].message


def test_a_negative_density_counts_as_none_and_is_named(empty_blend):
    filled_cube(lambda nodes: nodes("VolumeScatter", Density=-1.0).outputs[0])
    scene = extract_scene()
    assert scene.media == () or not any(np.any(medium.scattering) for medium in scene.media)
    assert [note for note in scene.notes if "'fog'" in note and "is negative, which counts as 0" in note]


def test_a_volume_without_a_file_is_no_file_that_is_read(empty_blend, tmp_path):
    """Saving makes its empty path a relative one, to the root of all files: a bake took every folder for one that is read."""
    link("empty", bpy.data.volumes.new("empty"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "empty.blend"))
    assert files_of_blend() == (str(tmp_path / "empty.blend"),)
