"""Progress lines."""

import io

import pytest

from rtgi_addon.jobs.console import ConsoleProgress, duration


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Closed(io.StringIO):
    def write(self, text):
        raise BrokenPipeError


def test_a_log_gets_few_whole_lines():
    stream = io.StringIO()
    console = ConsoleProgress(stream, interval=3600.0)
    for percent in range(101):
        console(percent / 100, "Tracing", 100.0 - percent)
    console.close()
    assert stream.getvalue().splitlines() == ["rtgi:   0 % Tracing, 1 min 40 s left", "rtgi: 100 % Tracing"]


def test_a_terminal_has_one_line_that_is_gone_at_the_end(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    stream = Terminal()
    console = ConsoleProgress(stream)
    console(0.1, "A long label " * 9, None)
    console(0.5, "Short", 9.0)
    shown = stream.getvalue()
    assert "\n" not in shown
    lines = shown.split("\r")[1:]
    assert len(lines[0]) == 39 and len(lines[1]) == 39 and lines[1].rstrip() == "rtgi:  50 % Short, 9 s left"
    console.close()
    assert stream.getvalue().endswith("\r")


def test_a_closed_stream_ends_no_bake():
    ConsoleProgress(Closed())(0.5, "Tracing", None)


@pytest.mark.parametrize(("seconds", "text"), [
    (0.2, "0 s"), (59.4, "59 s"), (59.6, "1 min 00 s"), (200, "3 min 20 s"), (3600, "1 h 00 min"), (7530, "2 h 05 min"),
])
def test_durations_read_as_people_say_them(seconds, text):
    assert duration(seconds) == text
