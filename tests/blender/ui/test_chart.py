"""Charts through Blender's doors: the command line as a process, the operator and its panel, Cycles as the reference."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from offset_technique import OffsetTechnique  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.evaluate.receivers import Receivers  # noqa: E402
from rtgi_addon.evaluate.references import PathReference  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.techniques import registry  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
CORNELL = ROOT / "sample_blends/cornell_box.blend"


def run(*words):
    """Exit code, stdout and stderr of the module's door."""
    done = subprocess.run([sys.executable, "-m", "rtgi_addon", *map(str, words)], capture_output=True, text=True, encoding="utf-8",
                          cwd=ROOT, timeout=300, env={**os.environ, "PYTHONPATH": str(ROOT)})
    return done.returncode, done.stdout, done.stderr


def test_the_command_line_writes_a_chart(tmp_path):
    code, text, err = run(CORNELL, "chart", "--out", tmp_path / "chart", "--techniques", "rsm", "--seeds", "1", "--points", "4",
                          "--probes", "2", "--noise", "0.2", "--no-maps", "--no-pictures", "--json")
    assert code == 0, err
    data = json.loads(text)
    written = json.loads((tmp_path / "chart/chart.json").read_text())
    assert set(written.pop("sha256")) == set(data["files"]) - {"chart.json"}
    assert data == {"out": str(tmp_path / "chart"), "files": data["files"], **written}
    assert [point["technique"] for point in data["points"]] == ["rsm"] * 4 and data["scene"] == "cornell_box"
    assert "known" in data["points"][0]["accuracy"] and data["points"][0]["rays"]["mean"] > 1000


def test_wrong_options_are_told_before_the_file_is_opened(tmp_path):
    for words, said in ((("--techniques", "magic"), "unknown technique 'magic'"),
                        (("--effects", "magic"), "unknown effect 'magic'"), (("--effects", "mist"), "draws as nothing looks"),
                        (("--seeds", "0"), "0 is less than 1"),
                        (("--noise", "-1"), "not a number above 0"), (("--reference", "guess"), "invalid choice")):
        code, _, err = run(tmp_path / "no.blend", "chart", "--out", tmp_path / "chart", *words)
        assert code == 2 and said in err, err
    assert not (tmp_path / "chart").exists()


@pytest.fixture
def offset(monkeypatch, empty_blend, tmp_path):
    """The add-on in a file with a lit room, charting a technique that is wrong by a known amount, and nothing else."""
    technique = OffsetTechnique()
    for name in set(registry()) - {"probes"}:
        monkeypatch.delitem(registry(), name)
    monkeypatch.setattr(type(registry()["probes"]), "sweep", lambda self: ())
    monkeypatch.setattr(type(registry()["probes"]), "lattices", ())
    monkeypatch.setitem(registry(), "offset", technique)
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT")
    bpy.ops.object.lightprobe_add(type="VOLUME")
    bpy.context.scene.rtgi.output = str(tmp_path / "bake")
    yield technique
    rtgi_addon.unregister()


def test_the_operator_charts_ranks_and_loads_the_picture(offset, tmp_path):
    pytest.importorskip("matplotlib", reason="draws the picture")
    from rtgi_addon.blender.ui.chart import charts, ranking
    assert bpy.ops.rtgi.chart(seeds=1, points=8, noise=0.2, maps=False) == {"FINISHED"}
    chart, folder = charts.charts[bpy.context.scene.name]
    assert folder == tmp_path / "bake_chart" and chart.complete and (folder / "chart.json").exists()
    rows = ranking(chart)
    assert len(rows) == 3 and all(name.startswith("offset, ") for _, name, _, _ in rows)
    errors = [float(error.rstrip("%")) for _, _, error, _ in rows]
    assert errors == sorted(errors) and any(on_front for on_front, *_ in rows)
    image = bpy.data.images["RTGI Chart"]
    assert image.size[0] > 1000 and Path(image.filepath) == folder / "chart.png"
    assert bpy.ops.rtgi.chart(seeds=1, points=8, noise=0.2, maps=False) == {"FINISHED"}
    assert [name for name in bpy.data.images.keys() if name.startswith("RTGI Chart")] == ["RTGI Chart"]


def test_a_cancelled_chart_is_kept_and_said_to_be_incomplete(offset):
    from rtgi_addon.blender.ui.chart import charts
    offset.on_bake = lambda number: number == 3 and charts.worker.cancel()
    assert bpy.ops.rtgi.chart(seeds=2, points=8, noise=0.2) == {"CANCELLED"}
    chart, folder = charts.charts[bpy.context.scene.name]
    assert [point.label for point in chart.points] == ["offset 0.5"] and not chart.complete
    assert not json.loads((folder / "chart.json").read_text())["complete"]
    layout = Recorder()
    bpy.types.RTGI_PT_chart.draw(SimpleNamespace(layout=layout), SimpleNamespace(
        scene=bpy.context.scene, region=SimpleNamespace(width=300)))
    assert "rtgi.chart" in layout.said and "offset, offset 0.5" in layout.said and "Cancelled before the end" in layout.said
    assert "Continue" in layout.said
    offset.on_bake = lambda number: None
    measured = len(offset.bakes)
    assert bpy.ops.rtgi.chart(seeds=2, points=8, noise=0.2, resume=True) == {"FINISHED"}
    assert charts.charts[bpy.context.scene.name][0].complete and len(offset.bakes) < measured + 10
    layout = Recorder()
    bpy.types.RTGI_PT_chart.draw(SimpleNamespace(layout=layout), SimpleNamespace(
        scene=bpy.context.scene, region=SimpleNamespace(width=300)))
    assert "Continue" not in layout.said


def test_what_cannot_be_charted_is_an_error(offset):
    for lamp in [obj for obj in bpy.context.scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(lamp)
    with pytest.raises(RuntimeError, match="has no light"):
        bpy.ops.rtgi.chart()


def test_another_file_forgets_the_charts(offset):
    from rtgi_addon.blender.ui.chart import charts
    charts.charts["Scene"] = ("a chart", Path())
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert charts.charts == {}


def diffuse(name, colour):
    """A plain diffuse material."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = colour
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


class Recorder:
    """A layout that notes texts and operators."""

    def __init__(self, said=None):
        self.said = [] if said is None else said

    def label(self, text="", **_):
        self.said.append(text)

    def operator(self, name, text="", **_):
        self.said += [name, text]
        return SimpleNamespace()

    def progress(self, text="", **_):
        self.said.append(text)

    def __getattr__(self, name):
        return lambda *_, **__: Recorder(self.said)


@pytest.mark.slow
def test_cycles_agrees_with_the_path_tracer_at_receivers_and_probes(empty_blend):
    """A closed coloured room: two references written by different people, within their own noise."""
    if not bpy.app.build_options.cycles_osl:
        pytest.skip("this Blender's Cycles has no OSL")
    from rtgi_addon.blender.cycles.receivers import CyclesReference
    from rtgi_addon.blender.extract import extract_scene
    bpy.ops.mesh.primitive_cube_add(size=2)
    bpy.context.object.data.materials.append(diffuse("red", (0.7, 0.4, 0.3, 1.0)))
    bpy.ops.object.light_add(type="POINT", location=(0.3, 0.2, 0.4))
    bpy.context.object.data.energy, bpy.context.object.data.shadow_soft_size = 40.0, 0.0
    context = LightContext(extract_scene(), 2)
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(12, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    receivers = Receivers((rng.random((12, 3)) * 1.6 - 0.8).astype(np.float32), normals, np.zeros(12, bool))
    path, cycles = PathReference(context, 0.01), CyclesReference(0.01, 2)
    for ours, theirs in ((path.irradiance(receivers), cycles.irradiance(receivers, Progress())),
                         (path.probes(receivers.points[:3], 2), cycles.probes(receivers.points[:3], 2, Progress()))):
        assert ours.mean.shape == theirs.mean.shape and theirs.noise < 0.012
        difference = ours.mean - theirs.mean
        squared = np.sum(difference**2) / np.sum(ours.variance + theirs.variance)
        # A mean of squared z over dozens of values, the noise of 4 renders being known to a third.
        assert squared < 3.0
        assert abs(difference.sum()) / ours.mean.sum() < 0.02
