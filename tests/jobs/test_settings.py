"""Settings from text."""

import pytest
from tiny_technique import TinyTechnique

from rtgi_addon import effects
from rtgi_addon.errors import UsageError
from rtgi_addon.jobs.settings import build_settings


@pytest.mark.parametrize(("name", "text", "value"), [
    ("order", "3", 3), ("rays", "none", None), ("rays", "64", 64), ("error", "1e-3", 1e-3), ("direct", "yes", True),
    ("direct", "False", False), ("pause", "2", 2.0),
])
def test_text_is_read_as_the_fields_type(name, text, value):
    found = getattr(build_settings(TinyTechnique(), {name: text}), name)
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize(("name", "text", "words"), [
    ("order", "2.5", "whole number"), ("error", "small", "a number"),
    ("error", "nan", "from 0.0001 to 1"), ("direct", "maybe", "true or false"),
    ("order", "none", "whole number"), ("order", "-1", "from 0 to 4"), ("fast", "1", "choose one of order"),
])
def test_what_does_not_fit_is_refused_by_name(name, text, words):
    with pytest.raises(UsageError, match=words) as caught:
        build_settings(TinyTechnique(), {name: text})
    assert name in caught.value.cause


def test_colours_and_settings_of_effects_are_read_alike():
    mist = effects.get("mist")
    assert build_settings(mist, {"color": "0.1, 0.2,3", "start": "2"}, "effect") == mist.Settings(color=(0.1, 0.2, 3.0), start=2.0)
    for text in ("1,2", "red", "1,2,x"):
        with pytest.raises(UsageError, match="give 3 numbers with commas"):
            build_settings(mist, {"color": text}, "effect")
    with pytest.raises(UsageError, match=r"color is -1: give at least 0"):
        build_settings(mist, {"color": "0,-1,0"}, "effect")
    with pytest.raises(UsageError, match=r"effect 'mist' has no setting 'x'"):
        build_settings(mist, {"x": "1"}, "effect")


def test_values_that_are_not_text_pass_through():
    assert build_settings(TinyTechnique(), {"rays": None, "order": 0}).rays is None
