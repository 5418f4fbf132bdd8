"""A style in an export to Godot: its files, its values, and what is said of what it loses."""

import json
import re
import zlib

import numpy as np
import pytest

from rtgi_addon.effects.stylized import EFFECT
from rtgi_addon.effects.stylized.presets import STYLES
from rtgi_addon.effects.stylized.ramps import ramp_table
from rtgi_addon.errors import UsageError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.godot.style import FILES, notes_on_style
from rtgi_addon.exchange.engines.style import SIZE, picture, ramp_scale, style_functions, style_values, write_ramps
from rtgi_addon.jobs.export import export_bundle

GODOT = engines.get("godot")


@pytest.mark.parametrize("name", STYLES)
def test_every_value_of_a_style_has_its_uniform(name):
    values = style_values(EFFECT.Settings(**STYLES[name]))
    declared = set(re.findall(r"uniform \w+ style_(\w+)", (FILES / "style.gdshaderinc.in").read_text()))
    assert set(values) == declared - {"ramps"}


def test_a_style_comes_with_its_kit_and_its_losses(kit_bundle, tmp_path):
    report = GODOT.export(kit_bundle, tmp_path / "out", ExportSettings(style=EFFECT.Settings(**STYLES["ink_and_wash"])))
    names = set(report.files)
    assert {"rtgi/style.json", "rtgi/style.tscn", "rtgi/style_view.gdshader", "rtgi/style_ramps.png.import",
            "conformance/style_picture.gd", "conformance/style/style.gd"} <= names
    index = json.loads((tmp_path / "out/rtgi/style.json").read_text())
    assert index["style"]["shading"] == 2 and index["style"]["ramp_scale"] == pytest.approx(1.4)
    assert style_functions() in (tmp_path / "out/rtgi/style.gdshaderinc").read_text()
    assert any("dots and strokes" in note and "marked edges" in note for note in report.notes)
    plain = GODOT.export(kit_bundle, tmp_path / "plain", ExportSettings())
    assert not any("style" in name for name in plain.files) and notes_on_style(None) == []


def test_the_picture_of_ramps_holds_them_to_eight_bits(tmp_path):
    settings = EFFECT.Settings(ramp="0:0.1,0.1,0.3 0.5:0.6,0.5,0.5 1:1.6,1,1", highlight_ramp="constant 0:0 0.5:1")
    write_ramps(tmp_path / "ramps.png", settings)
    data = (tmp_path / "ramps.png").read_bytes()
    place = data.index(b"IDAT")
    rows = np.frombuffer(zlib.decompress(data[place + 4:place + 4 + int.from_bytes(data[place - 4:place], "big")]), np.uint8)
    rows = np.cumsum(rows.reshape(2, 1 + 64 * 3)[:, 1:], axis=0, dtype=np.uint8).reshape(2, 64, 3) / 255.0
    linear = np.where(rows <= 0.04045, rows / 12.92, ((rows + 0.055) / 1.055) ** 2.4) * ramp_scale(settings)
    assert ramp_scale(settings) == pytest.approx(1.6)
    for found, text in zip(linear, (settings.ramp, settings.highlight_ramp), strict=True):
        assert np.abs(found - ramp_table(text)).max() < 0.5 * 1.6 * 2.4 / 1.055 / 255


@pytest.mark.parametrize("apart", [False, True])
def test_the_picture_has_lines_within_and_around_what_it_shows(apart):
    case = picture(Y_UP, apart)
    coverage = np.array(case["coverage"]).reshape(SIZE[::-1])
    assert 700 < np.count_nonzero(coverage > 64) < 3000 and coverage.max() == 255 and coverage[:5].max() == 0
    assert len(case["triangles"]) == 4 * 12 * 9 and case["objects"] == (4 if apart else 1)


def test_an_engine_that_takes_no_style_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(type(engines.get("threejs")), "styles", False)
    with pytest.raises(UsageError, match=r"three\.js takes no style: export to godot"):
        export_bundle(tmp_path, "threejs", tmp_path / "out", style=EFFECT.Settings())
