"""Settings of a technique or an effect from what a user typed."""

import types
from dataclasses import fields
from typing import Union, get_args, get_origin, get_type_hints

from ..errors import UsageError
from ..techniques import validate_settings

_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


def build_settings(owner, overrides: dict, kind: str = "technique"):
    """``Settings`` of ``owner`` (a Technique, or an Effect of ``kind`` "effect") with ``overrides`` (field name → value, or text to
    be read as the field's type).

    Raises UsageError for a name it does not have (with the list of those it has), text that is not of the field's type, and a
    value out of range.
    """
    hints = get_type_hints(owner.Settings)
    known = [item.name for item in fields(owner.Settings)]
    values = {}
    for name, value in overrides.items():
        if name not in known:
            raise UsageError(f"{kind} {owner.name!r} has no setting {name!r}", f"choose one of {', '.join(known)}")
        values[name] = _parse(name, value, hints[name]) if isinstance(value, str) else value
    settings = owner.Settings(**values)
    validate_settings(settings)
    return settings


def _parse(name: str, text: str, hint):
    """``text`` as the type ``hint`` (int, float, bool, str, or one of them or None; a tuple of three floats for a colour)."""
    if get_origin(hint) is tuple:
        return _colour(name, text, len(get_args(hint)))
    options = get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)
    if type(None) in options and text.lower() == "none":
        return None
    kind = next(option for option in options if option is not type(None))
    if kind is bool:
        if text.lower() not in _TRUE + _FALSE:
            raise UsageError(f"{name} is {text!r}", "give true or false")
        return text.lower() in _TRUE
    try:
        return kind(text)
    except ValueError:
        wanted = {int: "a whole number", float: "a number"}.get(kind, f"a value of type {kind.__name__}")
        raise UsageError(f"{name} is {text!r}", f"give {wanted}") from None


def _colour(name: str, text: str, count: int) -> tuple[float, ...]:
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        raise UsageError(f"{name} is {text!r}", f"give {count} numbers with commas between them")
    return values
