"""F12 with the engine RTGI, through Blender's own render operator."""

from pathlib import Path

import numpy as np
import pytest

import rtgi_addon

WIDTH, HEIGHT = 32, 24


@pytest.fixture
def scene(gpu_device, empty_blend, tmp_path):
    """A baked room in which a lamp hangs over a block, seen by a camera, with every pass on."""
    bpy = empty_blend
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0.3, 0.5, -1.5))
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:
        material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0.8, 0.4, 0.2, 1)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    bpy.context.object.data.materials.append(material)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.0, 1.0))
    bpy.context.object.data.energy = 100
    bpy.ops.object.lightprobe_add(type="VOLUME")
    bpy.context.object.scale = (2, 2, 2)
    probe = bpy.context.object.data
    probe.resolution_x = probe.resolution_y = probe.resolution_z = 3
    bpy.ops.object.camera_add(location=(0, -1.8, 0), rotation=(1.4, 0, 0))
    scene = bpy.context.scene
    scene.camera = bpy.context.object
    scene.camera.data.lens = 18
    scene.rtgi.output, scene.rtgi.mode, scene.rtgi.technique_probes.rays = str(tmp_path / "bake"), "RAYS", 64
    bpy.ops.rtgi.bake()
    scene.render.engine = "RTGI"
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.rtgi_preview.render_samples, scene.rtgi_preview.shadow_resolution = 2, 128
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_diffuse_color = True
    layer.rtgi.use_direct = layer.rtgi.use_indirect = layer.rtgi.use_irradiance = True
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"
    if hasattr(settings, "use_exr_interleave"):
        settings.use_exr_interleave = True  # one part, as before 5.0
    yield scene
    scene.render.engine = "BLENDER_WORKBENCH"
    rtgi_addon.unregister()


def read(path, layer="ViewLayer"):
    """Pass name → (h, w, channels) of a multilayer EXR, row 0 at the top."""
    from rtgi_addon.exchange.exr_codec import decode
    found = {}
    for name, plane in decode(Path(path).read_bytes())[0].items():
        where, entry, letter = name.rsplit(".", 2)
        if where == layer:
            found.setdefault(entry, {})[letter] = plane
    return {entry: np.stack([planes[letter] for letter in sorted(planes, key="RGBAXYZ".index)], axis=-1)
            for entry, planes in found.items()}


def render(scene, tmp_path, name="picture", **options):
    """The passes of a still render."""
    import bpy
    scene.render.filepath = str(tmp_path / f"{name}.exr")
    assert bpy.ops.render.render(write_still=True, **options) == {"FINISHED"}
    return read(scene.render.filepath)


def test_the_passes_add_up(scene, tmp_path):
    found = render(scene, tmp_path)
    assert set(found) == {"Combined", "Depth", "Normal", "DiffCol", "Direct", "Indirect", "Irradiance"}
    assert all(pixels.shape[:2] == (HEIGHT, WIDTH) for pixels in found.values())
    np.testing.assert_allclose(found["Combined"][..., :3], found["Direct"] + found["Indirect"], atol=1e-5)
    assert np.all(found["Combined"][..., 3] == 1.0)
    assert found["Direct"].mean() > 0.01 and found["Indirect"].mean() > 0.01
    # Most pixels see one surface only: there means of products are products of means.
    assert np.median(np.abs(found["DiffCol"] * found["Irradiance"] / np.pi - found["Indirect"])) < 1e-4


def test_media_have_passes_of_their_own(scene, tmp_path):
    import bpy
    clear = render(scene, tmp_path, "clear")
    bpy.ops.mesh.primitive_cube_add(size=1.2)
    material = bpy.data.materials.new("Fog")
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    fog, output = tree.nodes.new("ShaderNodeVolumePrincipled"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(fog.outputs[0], output.inputs["Volume"])
    bpy.context.object.data.materials.append(material)
    layer = scene.view_layers[0].rtgi
    layer.use_volume_direct = layer.use_volume_indirect = layer.use_transmittance = True
    found = render(scene, tmp_path, "foggy")
    names = ("Volume Direct", "Volume Indirect") if bpy.app.version >= (5, 0, 0) else ("VolumeDir", "VolumeInd")
    direct, indirect, left = (found[name] for name in (*names, "Transmittance"))
    assert 0.1 < left.min() < 0.9 and left.max() <= 1.0 and direct.max() > 0.005 and indirect.max() > 0.005
    surfaces = found["Direct"] + found["Indirect"]
    # Means of products are no products of means at edges, which there are few of.
    assert np.median(np.abs(surfaces * left + direct + indirect - found["Combined"][..., :3])) < 2e-3
    assert np.abs(found["Combined"] - clear["Combined"]).max() > 0.02
    scene.rtgi_effects.use_effect_media = False
    without = render(scene, tmp_path, "left out")
    assert np.all(without["Transmittance"] == 1.0) and not without[names[0]].any()


def test_the_geometry_is_that_of_the_scene(scene, tmp_path):
    import bpy
    found = render(scene, tmp_path)
    length = np.linalg.norm(found["Normal"], axis=-1)
    assert np.median(length) == pytest.approx(1.0, abs=1e-3)
    # The middle of the picture: along the camera's axis to the first surface there.
    eye = scene.camera.matrix_world
    forward = -eye.col[2].to_3d()
    hit, point, _, _, hit_object, _ = scene.ray_cast(bpy.context.evaluated_depsgraph_get(), eye.translation, forward)
    assert hit and hit_object is not None
    middle = found["Depth"][HEIGHT // 2 - 1:HEIGHT // 2 + 1, WIDTH // 2 - 1:WIDTH // 2 + 1].mean()
    assert middle == pytest.approx((point - eye.translation).length, rel=0.05)


def test_a_render_by_rays_needs_no_bake(scene, tmp_path):
    scene.rtgi_preview.render_samples = 16
    baked = render(scene, tmp_path)
    preview = scene.rtgi_preview
    preview.gather, preview.gather_error, preview.gather_samples = "rays", 0.05, 64
    scene.rtgi.technique = "vpl"
    found = render(scene, tmp_path, "rays")
    assert set(found) == set(baked)
    for name in ("Combined", "Direct", "Indirect", "Irradiance"):
        assert found[name].mean() == pytest.approx(baked[name].mean(), rel=0.15), name
    np.testing.assert_allclose(found["Depth"], baked["Depth"], rtol=0.01)


@pytest.mark.parametrize("technique", ["rsm", "lpv", "voxel_march"])
def test_techniques_that_need_no_bake_light_a_render_as_their_bake_does(scene, tmp_path, technique):
    """And with an object elsewhere than when it was baked."""
    import bpy
    block = bpy.data.objects["Cube.001"]
    scene.rtgi.technique = technique
    scene.rtgi.technique_rsm.resolution, scene.rtgi.technique_lpv.steps = 128, 32
    scene.rtgi.technique_voxel_march.resolution = 24
    scene.rtgi_preview.render_samples = 8

    def indirect():
        # The few samples of a pixel are another choice in every bake: their means over blocks are not.
        return render(scene, tmp_path)["Indirect"].reshape(HEIGHT // 8, 8, WIDTH // 8, 8, 3).mean(axis=(1, 3))

    live = indirect()
    block.location.x -= 0.8
    moved = indirect()
    bpy.ops.rtgi.bake()
    baked = indirect()
    block.location.x += 0.8
    back = indirect()
    assert live.min() > 0.01 and np.abs(moved - live).max() > 0.2 * live.mean()
    np.testing.assert_allclose(moved, baked, atol=0.05 * baked.mean())
    np.testing.assert_allclose(live, back, atol=0.05 * back.mean())


@pytest.mark.parametrize("crop", [True, False])
def test_a_border_holds_what_the_whole_picture_holds_there(scene, tmp_path, crop):
    whole = render(scene, tmp_path, "whole")
    scene.render.use_border, scene.render.use_crop_to_border = True, crop
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    part = render(scene, tmp_path, "part")
    for name, pixels in part.items():
        expected = whole[name][:HEIGHT // 2, WIDTH // 4:3 * WIDTH // 4]
        if not crop:
            # Blender itself fills what lies around the border.
            outside = pixels[HEIGHT // 2:]
            assert np.all(outside >= 1e10 if name == "Depth" else outside == 0)
            pixels = pixels[:HEIGHT // 2, WIDTH // 4:3 * WIDTH // 4]
        # Edges may fall to the other side of a pixel's centre.
        assert np.mean(np.abs(pixels - expected)) < 2e-3 * np.abs(whole[name]).mean(), name


def test_an_animation_is_lit_frame_by_frame(scene, tmp_path):
    """Power rises from 100 W to 300 W over three frames; everything in the closed room rises with it."""
    import bpy
    lamp = next(obj for obj in scene.objects if obj.type == "LIGHT").data
    scene.frame_start, scene.frame_end = 1, 3
    for frame, power in ((1, 100.0), (3, 300.0)):
        lamp.energy = power
        lamp.keyframe_insert("energy", frame=frame)
    scene.render.filepath = str(tmp_path / "frame_")
    assert bpy.ops.render.render(animation=True) == {"FINISHED"}
    first, last = (read(tmp_path / f"frame_{frame:04d}.exr") for frame in (1, 3))
    assert (tmp_path / "frame_0002.exr").exists()
    np.testing.assert_allclose(last["Direct"].mean(), 3 * first["Direct"].mean(), rtol=1e-3)
    # Relit probes take the light of texels' means, baked ones that of hits.
    np.testing.assert_allclose(last["Indirect"].mean(), 3 * first["Indirect"].mean(), rtol=0.1)


def test_a_transparent_film_leaves_the_world_out_and_keeps_its_light(scene, tmp_path):
    import bpy
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (1, 1, 1)
    if scene.world.node_tree is not None:
        background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
        background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (1, 1, 1, 1), 1.0
    scene.camera.location.y = -8
    opaque = render(scene, tmp_path, "opaque")["Combined"]
    scene.render.film_transparent = True
    clear = render(scene, tmp_path, "clear")["Combined"]
    assert np.all(opaque[..., 3] == 1) and np.all(clear[0, 0] == 0) and np.all(opaque[0, 0, :3] == 1)
    covered = clear[..., 3] == 1
    assert covered.any()
    np.testing.assert_allclose(clear[covered], opaque[covered], atol=1e-5)


def test_every_view_layer_is_rendered(scene, tmp_path):
    import bpy
    hidden = bpy.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    block = bpy.data.objects["Cube.001"]
    hidden.objects.link(block)
    for collection in list(block.users_collection):
        if collection is not hidden:
            collection.objects.unlink(block)
    second = scene.view_layers.new("Empty Room")
    second.layer_collection.children["Hidden"].exclude = True
    render(scene, tmp_path)
    path = tmp_path / "picture.exr"
    assert np.abs(read(path)["Combined"] - read(path, "Empty Room")["Combined"]).max() > 0.01
    assert set(read(path, "Empty Room")) == {"Combined"}


def test_trouble_makes_the_operator_fail(scene, tmp_path, monkeypatch):
    import bpy

    from rtgi_addon.blender.engine import final
    from rtgi_addon.errors import BakeError

    def refuse(*_):
        raise BakeError("the lamp is out", "change the bulb")

    monkeypatch.setattr(final, "lit_for", refuse)
    with pytest.raises(RuntimeError, match="the lamp is out: change the bulb"):
        bpy.ops.render.render()
    monkeypatch.setattr(final, "lit_for", lambda *_: 1 / 0)
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        bpy.ops.render.render()
    monkeypatch.undo()
    scene.camera.data.type = "PANO"
    with pytest.raises(RuntimeError, match="neither perspective nor orthographic"):
        bpy.ops.render.render()


def test_a_sky_is_asked_of_cycles_before_the_render_begins(scene, tmp_path):
    """During a render Cycles cannot be asked; a world that only it understands must be known by then."""
    import bpy
    world = scene.world = bpy.data.worlds.new("Gradient")
    if world.node_tree is None:
        world.use_nodes = True
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    gradient, coordinates = tree.nodes.new("ShaderNodeTexGradient"), tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], gradient.inputs["Vector"])
    tree.links.new(gradient.outputs["Color"], background.inputs["Color"])
    scene.camera.location = (0, -30, 0)
    sky = render(scene, tmp_path)["Combined"][0, :, 0]
    # The gradient grows along x, from 0 in the middle.
    assert sky[0] < 0.01 and sky[-1] > 0.1


def test_the_same_picture_every_time(scene, tmp_path):
    first, second = render(scene, tmp_path, "first"), render(scene, tmp_path, "second")
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_the_renderer_itself_gives_the_same_pixels(scene, tmp_path):
    from rtgi_addon.blender.engine.shown import shown_for
    from rtgi_addon.blender.extract import extract_scene
    from rtgi_addon.blender.ui.preview_settings import preview_settings
    from rtgi_addon.preview.renderer import PreviewRenderer
    from rtgi_addon.transport.views.camera import CameraView
    found = render(scene, tmp_path)
    extracted = extract_scene()
    renderer = PreviewRenderer(extracted, shown_for(scene).field, preview_settings(scene, final=True), ("combined",))
    for _ in range(2):
        renderer.frame(CameraView.of(extracted.cameras[0]), (WIDTH, HEIGHT))
    np.testing.assert_allclose(np.flipud(renderer.image("combined")), found["Combined"], atol=1e-5)
