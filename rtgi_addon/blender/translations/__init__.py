"""The add-on in the user's language: one folder a language, given to Blender's own translation. A language comes in as a folder
with ``INTERFACE`` and ``SENTENCES`` and a line in LANGUAGES; a test prints what one lacks.

Labels and tooltips of registered classes, and texts of layouts, Blender looks up itself. What the panel composes goes through
Blender's ``pgettext_…`` before it is formatted. What comes from below, where nothing knows Blender, is a finished English
sentence: ``sentence`` finds the pattern it was made from.

Blender asks an add-on's catalogue only for what its own does not know, so words that both have stay Blender's.
"""

import re
from collections.abc import Mapping
from functools import cache, lru_cache

import bpy

from . import de
from .settings import made_from_settings

# By Blender's name of the locale.
LANGUAGES = {"de_DE": de}
# Where a label may stand: the default context, and that of operators.
_CONTEXTS = ("*", "Operator")


def sentence(text: str) -> str:
    """``text`` (an error, a note or a step of progress, in English) in the user's language, as far as its catalogue knows it."""
    language = _language()
    return text if language is None else _known(language.__name__, text) or text


def _language():
    """The user's, or None where it is English or not here."""
    return LANGUAGES.get(bpy.app.translations.locale) if bpy.context.preferences.view.use_translate_interface else None


@cache
def _patterns(language: str) -> list[tuple[re.Pattern, str]]:
    """Every English pattern as an expression and its translation, the most particular first."""
    sentences: Mapping[str, str] = next(module for module in LANGUAGES.values() if module.__name__ == language).SENTENCES
    by_length = sorted(sentences, key=lambda pattern: len(_PLACE.sub("", pattern)), reverse=True)
    return [(re.compile(_expression(pattern), re.DOTALL), sentences[pattern]) for pattern in by_length]


_PLACE = re.compile(r"\{(\d+)\}")


def _expression(pattern: str) -> str:
    parts = _PLACE.split(pattern)
    return "".join(f"(?P<p{part}>.+?)" if number % 2 else re.escape(part) for number, part in enumerate(parts))


@lru_cache(maxsize=1024)
def _known(language: str, text: str) -> str | None:
    """``text`` translated: as a cause and its remedy with a colon between them, or whole; None where neither is known."""
    for colon in reversed([found.start() for found in re.finditer(": ", text)]):
        cause, remedy = _matched(language, text[:colon]), _matched(language, text[colon + 2:])
        if cause is not None and remedy is not None:
            return f"{cause}: {remedy}"
    # A pattern that ends in a place would take a remedy for a part of it, so it comes second.
    return _matched(language, text)


def _matched(language: str, text: str) -> str | None:
    for expression, translation in _patterns(language):
        found = expression.fullmatch(text)
        if found:
            words = {name[1:]: _known(language, word) or word for name, word in found.groupdict().items()}
            return "".join(words[part] if number % 2 else part for number, part in enumerate(_PLACE.split(translation)))
    return None




def interface(language) -> dict[str, str]:
    """English → translated of all labels, tooltips and lines of the interface in one of LANGUAGES."""
    words: Mapping[str, str] = language.INTERFACE

    def translate(text: str) -> str:
        return words.get(text, text)

    return {**dict(made_from_settings(translate)), **words}


def register() -> None:
    """Give Blender the catalogues."""
    bpy.app.translations.register(__name__, {
        locale: {(context, english): translated for english, translated in interface(language).items() for context in _CONTEXTS}
        for locale, language in LANGUAGES.items()})


def unregister() -> None:
    """Take them back."""
    bpy.app.translations.unregister(__name__)
    _known.cache_clear()
    _patterns.cache_clear()
