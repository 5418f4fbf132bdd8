"""Names of settings in charts."""

from dataclasses import fields


def setting_label(settings, default) -> str:
    """What sets ``settings`` apart from ``default``, as short as the settings' own labels allow."""
    parts = []
    for item in fields(settings):
        value = getattr(settings, item.name)
        if value != getattr(default, item.name):
            name = " ".join(word if word.isupper() else word.lower() for word in item.metadata["label"].split())
            counts = isinstance(value, int) and not isinstance(value, bool) and name.endswith("s")
            parts.append(name if value is True else f"no {name}" if value is False else
                         f"{value:,g} {name[:-1] if value == 1 else name}" if counts else f"{name} {_number(value)}")
    return ", ".join(parts) or "defaults"


def _number(value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
