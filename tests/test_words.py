"""What names hold never reaches a terminal as orders."""

import pytest

from rtgi_addon.words import as_lines, one_line, printable


@pytest.mark.parametrize(("text", "shown"), [
    ("Küche 🏠 – 日本語, 50 %", "Küche 🏠 – 日本語, 50 %"), ("a\nb", "a\nb"), ("\x1b[2J\x07", "\\x1b[2J\\x07"),
    ("a\rb\tc", "a\\rb\\tc"),
    ("\x9b31m", "\\x9b31m"), ("abc\u202egpj.exe", "abc\\u202egpj.exe"), ("a\u2028b", "a\\u2028b"), ("\udcff", "\\udcff"),
    ("👩\u200d🚀", "👩\u200d🚀"), ("\x7f\x00", "\\x7f\\x00"),
])
def test_control_characters_are_shown_as_what_they_are(text, shown):
    assert printable(text) == shown
    assert all(letter == "\n" or letter.isprintable() or letter in "\u200d" for letter in printable(text))
    printable(text).encode("utf-8")


def test_a_name_makes_no_lines_of_its_own():
    assert one_line("a\nrtgi: error: b") == "a\\nrtgi: error: b"
    assert as_lines(["one", "two\nthree"]) == "one\ntwo\\nthree"
