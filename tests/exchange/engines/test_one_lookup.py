"""The look-up is said once: every reader takes the numbers and, where its language can, the functions from one place.

Readers in languages of their own (GDScript, JavaScript, three's node language) are held to the numbers here, without an engine;
what they do with them is held by the kit's cases, in the engines (tests/engines).
"""

import re
from pathlib import Path

import numpy as np
import pytest

from rtgi_addon.exchange.engines.glsl import shared_glsl
from rtgi_addon.exchange.engines.godot import shader_include
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.numerics import sh
from rtgi_addon.preview.indirect.probes import probe_tables
from rtgi_addon.techniques.lattice.weights import CONSTANTS, shader_constants

EXPORTS = Path(__file__).resolve().parents[3] / "rtgi_addon/exchange/engines"
LANGUAGES = {"godot/files/rtgi/volumes.gd": r"^const ([A-Z_0-9]+) := ([0-9.e+-]+)$",
             "threejs/export/rtgi/lookup.js": r"^export const ([A-Z_0-9]+) = ([0-9.e+-]+);$"}
# Whole numbers and halves are geometry; SH's own constants turn light probes, which the kit's "light probe, moved" holds.
PLAIN = re.compile(r"(?:\d+|\d*\.[05]|0\.25|0\.28209\d*|0\.48860\d*|1\.09254\d*|0\.31539\d*|0\.54627\d*)")


def test_the_cosine_lobes_bands_are_those_of_the_harmonics():
    """Where each band's harmonic is known: A_l·Y of 1, of z along z, of xy and of 3z² − 1."""
    diagonal = np.array([[np.sqrt(0.5), np.sqrt(0.5), 0.0], [0.0, 0.0, 1.0]])
    found = sh.evaluate(diagonal, 2) * sh.cosine_coefficients(2)
    expected = [found[0, 0], found[1, 2], 2.0 * found[0, 4], 0.5 * found[1, 6]]
    assert np.allclose([CONSTANTS[name] for name in ("COSINE_0", "COSINE_1", "COSINE_2", "COSINE_2_ZONAL")], expected, rtol=1e-6)


@pytest.mark.parametrize("file", LANGUAGES)
def test_hand_written_readers_hold_the_same_numbers(file):
    found = dict(re.findall(LANGUAGES[file], (EXPORTS / file).read_text(encoding="utf-8"), re.MULTILINE))
    found = {name: float(value) for name, value in found.items() if name in CONSTANTS}
    assert set(found) == set(CONSTANTS)
    for name, value in CONSTANTS.items():
        assert np.float32(found[name]) == np.float32(value), name


def test_the_node_language_takes_them_from_the_javascript():
    text = (EXPORTS / "threejs/export/rtgi/RTGIProbeLight.js").read_text(encoding="utf-8")
    imported = re.search(r"import \{([^}]*)\} from './lookup\.js'", text)[1]
    assert set(CONSTANTS) <= {name.strip() for name in imported.split(",")}
    for name in CONSTANTS:
        assert text.count(name) > 1, f"{name} is imported and not used"


@pytest.mark.parametrize("file", [*LANGUAGES, "threejs/export/rtgi/RTGIProbeLight.js", "threejs/export/rtgi/shader.js",
                                  "godot/files/rtgi/irradiance.gdshaderinc.in"])
def test_no_reader_has_numbers_without_a_name(file):
    text = re.sub(r"(//|##?).*$", "", (EXPORTS / file).read_text(encoding="utf-8"), flags=re.MULTILINE)
    text = re.sub("|".join([*LANGUAGES.values(), r"'[^'\n]*'"]), "", text, flags=re.MULTILINE)
    odd = [number for number in re.findall(r"(?<![\w.$])\d+\.?\d*(?:e[+-]?\d+)?", text) if not PLAIN.fullmatch(number)
           and number != "3.402823e38" and not re.fullmatch(r"\d+\.0", number)]
    assert odd == []


def test_every_host_of_glsl_takes_the_functions_as_they_are():
    shared = shared_glsl()
    assert "float rtgi_seen_share(" in shared and "vec2 rtgi_octahedral(" in shared
    for name, value in shader_constants().items():
        assert f"#define {name} {value}\n" in shared and shared.count(name) > 1
        assert np.float32(value) == np.float32(CONSTANTS[name.removeprefix("RTGI_")])
    assert shared in shader_include(2)
    assert set(shader_constants().items()) <= set(probe_tables(kit_field()).defines)


def test_no_host_has_a_function_of_them_twice():
    """What the shared file defines is defined nowhere else."""
    functions = re.findall(r"^\w+ (rtgi_\w+)\(", shared_glsl(), re.MULTILINE)
    assert len(functions) >= 8
    for file in ("threejs/export/rtgi/shader.js", "godot/files/rtgi/irradiance.gdshaderinc.in"):
        text = (EXPORTS / file).read_text(encoding="utf-8")
        assert not [name for name in functions if re.search(rf"\w+ {name}\([^;]*\) ?\{{", text)]
        assert "rtgi_probe_weight(" in text
