"""Text on its way to a person: names come from files of others, and what a terminal would obey in them is shown instead of done."""

from collections.abc import Iterable

# No letters of their own, but parts of names that people write: joiners of emoji and scripts, the space that does not break.
_HARMLESS = "\u200c\u200d\u00a0"


def printable(text: str) -> str:
    """``text`` with line ends as they are and every other control character (escape codes, carriage returns, characters that turn
    the direction of writing) as its escape sequence."""
    return "".join(letter if letter == "\n" or letter.isprintable() or letter in _HARMLESS else _escaped(letter) for letter in text)


def one_line(text: str) -> str:
    """``text`` as ``printable`` gives it, line ends escaped too."""
    return printable(text).replace("\n", "\\n")


def as_lines(parts: Iterable[str]) -> str:
    """Each of ``parts`` on a line of its own, and on no more than one, whatever names it holds."""
    return "\n".join(map(one_line, parts))


def _escaped(letter: str) -> str:
    return letter.encode("unicode_escape", "surrogatepass").decode("ascii") if letter < "\ud800" or letter > "\udfff" \
        else f"\\u{ord(letter):04x}"
