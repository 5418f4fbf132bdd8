"""Effects are found by their files, and follow each other by their stages."""

from dataclasses import dataclass

import numpy as np
import pytest
from picture_stage import SIZE, stage, view

from rtgi_addon import effects
from rtgi_addon.effects.base import STAGES, Chosen, Effect, apply_all, in_order, setting
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.errors import UsageError


@dataclass(frozen=True)
class Amount:
    """One number."""

    amount: float = setting(2.0, "Amount", "How much", "", 0.0, 10.0)
    way: str = setting("up", "Way", "Where to", choices=("down", "up"))


def effect(label, stage, made):
    """An effect called ``label`` whose picture is ``made(frame, settings)``."""
    body = {"name": label, "label": label, "description": label, "stage": stage, "Settings": Amount,
            "apply": lambda self, frame, field, settings: made(frame, settings)}
    return type(label, (Effect,), body)()


def test_what_is_found_says_what_it_is():
    for name, found in effects.registry().items():
        assert name == found.name and found.stage in STAGES and found.label and found.description
        assert effects.get(name) is found
        effects.validate_settings(found.Settings())
    assert effects.names() == list(effects.registry())


def test_an_unknown_effect_is_told_with_the_known_ones():
    with pytest.raises(UsageError, match="unknown effect 'nothing'"):
        effects.get("nothing")


def test_stages_follow_each_other_whatever_order_they_are_given_in():
    given = [effect("b", "style", None), effect("z", "media", None), effect("a", "style", None), effect("y", "light", None)]
    found = in_order(Chosen(entry, Amount()) for entry in given)
    assert [entry.effect.name for entry in found] == ["y", "z", "a", "b"]
    with pytest.raises(UsageError, match="amount"):
        in_order([Chosen(given[0], Amount(amount=11.0))])


def test_each_effect_works_on_what_the_one_before_made():
    frame = draw_frame(stage(), None, view(), SIZE)
    double = effect("double", "reflections", lambda frame, settings: frame.light * settings.amount)
    add = effect("add", "media", lambda frame, settings: frame.light + 1.0)
    after = apply_all(frame, None, [Chosen(add, Amount()), Chosen(double, Amount(amount=3.0))])
    assert np.allclose(after.light, 3 * frame.light + 1)
    assert np.allclose(after.history.images["double"], 3 * frame.light) and after.history.frame.light is frame.light
    assert np.array_equal(after.history.images["add"], after.light)
    assert apply_all(frame, None, []).light is frame.light


def test_history_reaches_the_next_frame_and_no_further():
    seen = []

    def look(frame, settings):
        seen.append(frame.history)
        return frame.light

    chosen, history = [Chosen(effect("look", "style", look), Amount())], None
    for index in range(3):
        frame = draw_frame(stage(), None, view(), SIZE, index=index, history=history)
        history = apply_all(frame, None, chosen).history
    assert seen[0] is None and seen[2].frame.index == 1 and seen[2].frame.history is None


def test_a_picture_of_another_size_is_refused():
    frame = draw_frame(stage(), None, view(), SIZE)
    with pytest.raises(ValueError, match="'half' returned"):
        apply_all(frame, None, [Chosen(effect("half", "style", lambda frame, settings: frame.light[::2]), Amount())])


def test_parameters_are_the_settings_with_choices_counted():
    assert effect("any", "style", None).parameters(Amount(), stage()) == {"amount": 2.0, "way": 1}
