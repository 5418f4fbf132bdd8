"""A style in a real Godot: what the export writes is read without a word, and its lines are ours, pixel by pixel."""


import pytest
from real_godot import complaints, drawing, godot, imported, needs_godot

from rtgi_addon.effects.stylized import EFFECT
from rtgi_addon.effects.stylized.presets import STYLES
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings

pytestmark = [pytest.mark.slow, needs_godot]


def test_the_lines_are_those_of_the_effect(kit_bundle, tmp_path):
    settings = ExportSettings(style=EFFECT.Settings(**STYLES["cel"]))
    project = imported(engines.get("godot").export(kit_bundle, tmp_path / "project", settings).out)
    code, said = godot(project, "--script", "conformance/style_picture.gd")
    drawing(said)
    assert code == 0 and "PASS lines" in said and not complaints(said), said
    # Without lines the picture is white, and the script sees it.
    shader = project / "conformance" / "style" / "style_view.gdshader"
    shader.write_text(shader.read_text().replace("if (style_lines)", "if (false)"))
    code, said = godot(project, "--script", "conformance/style_picture.gd")
    assert code == 1 and "FAIL lines" in said
