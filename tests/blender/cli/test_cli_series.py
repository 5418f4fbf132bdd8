"""`bake --frames` from the shell: a file whose lamp brightens, read frame by frame, and the commands that take what it wrote."""

import json
import os
import subprocess
import sys

import pytest
from command_line import ROOT

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from rtgi_addon.blender.cli.doors import main_module  # noqa: E402


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """A .blend saved at frame 1 whose lamp brightens from 100 to 300 W until frame 3."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    lamp = bpy.data.lights.new("Lamp", "POINT")
    for frame, energy in ((1, 100.0), (3, 300.0)):
        lamp.energy = energy
        lamp.keyframe_insert("energy", frame=frame)
    probes = bpy.data.lightprobes.new("Probes", "VOLUME")
    probes.resolution_x = probes.resolution_y = probes.resolution_z = 2
    camera = bpy.data.cameras.new("Camera")
    for data, place in ((lamp, (0.5, 0.3, 1.2)), (probes, (0.0, 0.0, 0.0)), (camera, (0.0, 0.0, 1.5))):
        obj = bpy.data.objects.new(data.name, data)
        obj.location = place
        bpy.context.collection.objects.link(obj)
    bpy.data.objects["Probes"].scale = (1.8, 1.8, 1.8)
    scene = bpy.context.scene
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = bpy.data.objects["Camera"], 24, 16
    scene.frame_set(1)
    path = tmp_path_factory.mktemp("film") / "film.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    yield path
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def run(*words):
    """Exit code and what was printed as JSON, of a command line in a process of its own: it keeps the streams."""
    done = subprocess.run([sys.executable, "-m", "rtgi_addon", *map(str, words), "--json"], capture_output=True, text=True,
                          cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, timeout=300, check=False)
    assert done.stdout, done.stderr
    return done.returncode, json.loads(done.stdout)


def refused(capsys, *words):
    """Exit code and message of a command line that is wrong before anything is opened."""
    code = main_module([*words, "--json"])
    return code, json.loads(capsys.readouterr().out)["error"]["message"]


def test_a_series_from_file_to_picture(film, tmp_path):
    out = tmp_path / "series"
    code, told = run(film, "bake", "--out", out, "--frames", "1-5:2", "--rays", 64)
    assert code == 0 and [(entry["frame"], entry["bundle"]) for entry in told["frames"]] == [
        (1, "frame_0001"), (3, "frame_0003"), (5, "frame_0003")]
    light = {name: bundle["volumes"][0]["mean_radiance"] for name, bundle in run("info", out)[1]["bundles"].items()}
    assert light["frame_0003"] == pytest.approx(3.0 * light["frame_0001"], rel=1e-3)
    code, told = run(film, "bake", "--out", out, "--frames", "1-6:1", "--rays", 64, "--resume")
    assert code == 0 and told["kept"] == [1, 3] and list(told["baked"]) == ["2"] and told["shared"] == [[4, 3], [5, 3], [6, 3]]
    picture = ("render", "--bundle", out, "--device", "cpu", "--samples", 1, "--out", tmp_path / "picture.png")
    for frame, shown, notes in ((2, "frame_0002", 0), (9, "frame_0003", 1)):
        code, told = run(film, *picture, "--frame", frame)
        assert code == 0 and told["technique"].startswith(shown)
        assert len([note for note in told["notes"] if "shows the bake of frame 6" in note]) == notes
    code, told = run("export", out, "--engine", "threejs", "--out", tmp_path / "game")
    assert code == 1 and "is a series of bundles, and one is wanted: give the folder" in told["error"]["message"]


def test_viewport_and_renders_show_the_bundle_of_the_frame(film, tmp_path):
    out = tmp_path / "series"
    assert run(film, "bake", "--out", out, "--frames", "1-2", "--rays", 64)[0] == 0
    import rtgi_addon
    bpy.ops.wm.open_mainfile(filepath=str(film))
    rtgi_addon.register()
    try:
        from rtgi_addon.blender.bundles import bundle_folders, exported_bundle
        from rtgi_addon.blender.engine.shown import shown_for
        scene = bpy.context.scene
        scene.rtgi.output = str(out)
        seen = []
        for frame in (1, 2, 7):
            scene.frame_set(frame)
            shown = shown_for(scene)
            seen.append((float(shown.field.grids()[0].sh[..., 0, :].mean()), shown.note))
        assert seen[1][0] == pytest.approx(2.0 * seen[0][0], rel=1e-3) and seen[2][0] == seen[1][0]
        assert [note for _, note in seen] == ["", "", "Frame 7 shows the bake of frame 2"]
        # That of another frame, recorded as the last bake, is one of the series as well.
        scene.rtgi.last_bake.folder = str(out / "frame_0001")
        assert bundle_folders(scene) == [out / "frame_0002"] == [exported_bundle(scene)[0]]
        (out / "series.json").write_text("{")
        assert "cannot be shown" in shown_for(scene).note
    finally:
        rtgi_addon.unregister()


@pytest.mark.parametrize(("words", "told"), [
    (("bake", "--out", "x", "--frames", "5-1"), "is not frames A-B"),
    (("bake", "--out", "x", "--frames", "1-9:0"), "is not frames A-B"),
    (("bake", "--out", "x", "--frames", "all"), "is not frames A-B"),
    (("bake", "--out", "x", "--frames", "1-2", "--frame", "1"), "--frame is about one frame"),
    (("bake", "--out", "x", "--frames", "1-2", "--picture", "x.png"), "--picture is about one frame"),
    (("bake", "--out", "x", "--frames", "1-2", "--verify"), "--verify is about one frame"),
    (("bake", "--out", "x", "--frames", "1-2", "--technique", "auto"), "--technique auto is about one frame"),
    (("bake", "--out", "x", "--fram", "1-2"), "unrecognized arguments: --fram"),
    (("bake", "--out", "x", "--tech", "vpl"), "unrecognized arguments: --tech")])
def test_what_does_not_go_together_is_refused_before_the_file_is_opened(capsys, words, told):
    code, message = refused(capsys, "nothing.blend", *words)
    assert code == 2 and told in message


def test_no_option_stands_for_another_that_begins_alike(capsys):
    code, message = refused(capsys, "relight", "bundle", "--out", "x", "--frame", "frames.json")
    assert code == 2 and "unrecognized arguments: --frame" in message
