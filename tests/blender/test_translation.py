"""Every text of the interface goes through Blender's translation, and German has all of them."""

import json
import os
import re
import string
import subprocess
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import interface_strings as harvest  # noqa: E402

import rtgi_addon  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
PLACE = re.compile(r"\{[^}]*\}")


@pytest.fixture(scope="module", autouse=True)
def registered():
    """The add-on, as a user has it."""
    rtgi_addon.register()
    yield
    rtgi_addon.unregister()


def languages():
    from rtgi_addon.blender.translations import LANGUAGES
    return LANGUAGES


def places(text):
    """What is filled in, with its format."""
    return sorted(PLACE.findall(text))


def missing(texts, catalogue):
    """Lines to paste into a catalogue."""
    return "\n".join(f"    {text!r}: ,  # {where}" for text, where in texts.items() if text not in catalogue)


def test_the_harvest_finds_what_it_should():
    classes, source = harvest.of_classes(), harvest.of_source()
    assert {"Bake Probes", "Target Error", "Most Rays", "RTGI Overrides", "Error Maps", "Path Tracer"} <= set(classes)
    assert {"Nothing baked yet", "A bake is already running", "Baked {probes:,} probes in {time}", "Albedo"} <= set(source)
    sentences = set(harvest.sentences())
    assert {"{0} has no geometry", "every probe of the volume {0} lies inside geometry", "light of lamps"} <= sentences
    assert len(classes) > 150 and len(source) > 50 and len(harvest.sentences()) > 150


def test_no_text_goes_past_translation():
    assert harvest.untranslated() == []


@pytest.mark.parametrize("locale", ["de_DE"])
def test_every_text_of_the_interface_is_in_the_catalogue(locale):
    from rtgi_addon.blender.translations import interface
    catalogue = interface(languages()[locale])
    lacking = missing({**harvest.of_classes(), **harvest.of_source()}, catalogue)
    assert not lacking, f"add to translations/{languages()[locale].__name__.rsplit('.')[-1]}/interface.py:\n{lacking}"


@pytest.mark.parametrize("locale", ["de_DE"])
def test_every_sentence_from_below_the_panel_is_in_the_catalogue(locale):
    lacking = missing(harvest.sentences(), languages()[locale].SENTENCES)
    assert not lacking, f"add to translations/{languages()[locale].__name__.rsplit('.')[-1]}/sentences.py:\n{lacking}"


def test_what_settings_are_made_of_is_in_the_catalogue():
    """Their composed tooltips would be found even if a word in them stayed English."""
    from dataclasses import fields

    from rtgi_addon import effects, techniques
    from rtgi_addon.preview.settings import OverlaySettings, PreviewSettings
    owners = *techniques.registry().values(), *effects.registry().values()
    for settings in (*(owner.Settings for owner in owners), PreviewSettings, OverlaySettings):
        for item in fields(settings):
            for text in (item.metadata["label"], item.metadata["description"].rstrip(".")):
                assert text in languages()["de_DE"].INTERFACE, f"{settings.__name__}.{item.name}: {text!r}"


@pytest.mark.parametrize("part", ["INTERFACE", "SENTENCES"])
def test_placeholders_agree(part):
    for locale, language in languages().items():
        for english, translated in getattr(language, part).items():
            assert places(english) == places(translated), f"{locale}: {english!r}"
            assert translated.strip() == translated and bool(translated), f"{locale}: {english!r}"
            assert english[-1:] in ".…" or translated[-1:] not in ".", f"{locale}: {english!r} has no full stop"
            list(string.Formatter().parse(translated))


def test_german_is_german():
    from rtgi_addon.blender.translations import interface
    catalogue = interface(languages()["de_DE"])
    same = {english for english, translated in catalogue.items() if english == translated and len(english.split()) > 2}
    assert not same


@pytest.fixture
def german(monkeypatch):
    """Sentences in German, whatever this Blender's language is."""
    from rtgi_addon.blender import translations
    monkeypatch.setattr(translations, "_language", lambda: translations.LANGUAGES["de_DE"])
    return translations.sentence


def test_sentences_are_found_by_their_patterns(german):
    from rtgi_addon.errors import BakeError
    assert german(str(BakeError("every probe of the volume 'Hall: 2' lies inside geometry",
                                "move or resize it so that it covers open space, or fit it to the scene"))) == (
        "jede Sonde des Volumens 'Hall: 2' liegt in Geometrie: so rücken oder skalieren, dass es freien Raum umfasst, oder an die "
        "Szene anpassen")
    assert german("lamp Sun is invisible to diffuse rays: it is left out").startswith("Lampe Sun ist für diffuse")
    assert german("material 'Brick': its bumps are left out") == "Material „Brick“: seine Unebenheiten bleiben außen vor"
    assert german("unknown technique 'x': choose one of lpv, vpl") == "unbekannte Technik 'x': eines wählen von lpv, vpl"
    assert german("what nobody wrote: here") == "what nobody wrote: here"
    assert german("") == ""


def test_sentences_that_no_pattern_of_the_source_shows(german, monkeypatch):
    """Those that are put together elsewhere than where they are raised."""
    import scene_builders

    from rtgi_addon import kernels
    from rtgi_addon.evaluate.leaks import Cause
    from rtgi_addon.techniques.lattice.fit import describe
    from rtgi_addon.techniques.lattice.near_notes import NearGlow, notes_on
    from rtgi_addon.transport.rays import choose, embree
    said = [cause.text for cause in Cause if cause is not Cause.NONE] + ["3 of 2,000 receivers leak", "Relighting"]
    said.append(describe(scene_builders.closed_box().volumes[0]))
    said += ["effect 'mist' has no setting 'x': choose one of start, depth"]
    said += ["'Probes' goes from 4 x 4 x 4 to 8 x 6 x 4 probes: finer.", "rsm leaves out the light of the world",
             "SH of order 2, 9 numbers a channel: the lattice is off by 4 % with it, which is more than is asked for."]
    for why in ("probes are fitted", "the scene has media", "light is linked to objects", "a volume does not capture all light"):
        said += [why, *notes_on(NearGlow((), ("Tube",), why))]
    with kernels.switched_off():
        said.append(choose.slow_rays_warning())
    monkeypatch.setattr(embree, "rtcore_scene", None)
    said.append(choose.slow_rays_warning())
    for text in said:
        assert german(text) != text


def test_in_english_sentences_stay_as_they_are():
    from rtgi_addon.blender.translations import sentence
    assert sentence("the scene has no geometry") == "the scene has no geometry"


IN_GERMAN = """
import sys, json
sys.path.insert(0, sys.argv[-1])
import bpy, rtgi_addon
from bpy.app.translations import pgettext_iface, pgettext_rpt, pgettext_tip
view = bpy.context.preferences.view
def look():
    return [pgettext_iface("Bake Probes", "Operator"), pgettext_iface("Target Error"), pgettext_rpt("Chart cancelled"),
            pgettext_tip("A fixed number of rays for every probe instead of a target error (16 to 1,048,576)")]
before = dir(bpy.app.translations)
rtgi_addon.register()
english = look()
view.language = "de_DE"
view.use_translate_interface = view.use_translate_tooltips = view.use_translate_reports = True
german = look()
from rtgi_addon.blender.translations import sentence
german.append(sentence("the scene has no geometry: add a mesh that is visible to renders"))
rtgi_addon.unregister()
print("LOOKED", json.dumps([english, german, look()]))
"""


@pytest.mark.skipif("RTGI_BLENDER" not in os.environ,
                    reason="needs a Blender with its languages (RTGI_BLENDER): the module has none")
def test_a_german_blender_speaks_german(tmp_path):
    import shlex
    (tmp_path / "look.py").write_text(IN_GERMAN)
    command = [*shlex.split(os.environ["RTGI_BLENDER"]), "-b", "--factory-startup", "--python-exit-code", "9"]
    ran = subprocess.run([*command, "--python", str(tmp_path / "look.py"), "--", str(ROOT)], capture_output=True, text=True,
                         timeout=300, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    english, german, after = json.loads(next(line[7:] for line in ran.stdout.splitlines() if line.startswith("LOOKED ")))
    assert english == after and english[0] == "Bake Probes"
    assert german == ["Sonden backen", "Zielfehler", "Vergleich abgebrochen",
                      "Eine feste Zahl von Strahlen für jede Sonde statt eines Zielfehlers (16 bis 1,048,576)",
                      "die Szene hat keine Geometrie: ein Mesh hinzufügen, das beim Rendern sichtbar ist"]
