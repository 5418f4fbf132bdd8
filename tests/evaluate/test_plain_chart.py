"""The chart that needs nothing but numpy: points where their time and error are, letters that can be told apart."""

import numpy as np

from rtgi_addon.evaluate.dot_letters import dots
from rtgi_addon.evaluate.plain_chart import _COLOURS, _Canvas


def canvas_of(*points):
    """The canvas of one technique's ``points``, times and errors."""
    return _Canvas([("probes", time, error, False) for time, error in points])


def test_letters_are_told_apart():
    letters = [chr(code) for code in range(32, 127)]
    assert len({dots(letter).tobytes() for letter in letters}) == len(letters)
    assert dots("Ab", 3).shape == (24, 36) and np.array_equal(dots("é"), dots("?")) and not dots(" ").any()
    assert dots("l")[:7].any() and not dots("x")[7].any() and dots("g")[7].any()


def test_points_stand_where_they_are_on_logarithmic_axes():
    canvas = canvas_of((0.1, 0.5), (1.0, 0.05), (10.0, 0.005))
    places = [canvas.place(time, error) for time, error in ((0.1, 0.5), (1.0, 0.05), (10.0, 0.005))]
    steps = np.diff(places, axis=0)
    assert np.all(np.abs(steps[0] - steps[1]) <= 1) and steps[0][0] > 0 and steps[0][1] > 0
    canvas.point(1, _COLOURS[0], True)
    x, y = places[1]
    assert tuple(canvas.pixels[y, x]) == _COLOURS[0]
    canvas.point(0, _COLOURS[1], False)
    x, y = places[0]
    assert tuple(canvas.pixels[y, x]) == (255, 255, 255) and (canvas.pixels[y, x - 6:x] == _COLOURS[1]).all(axis=1).any()


def test_the_front_is_a_line_from_point_to_point_and_a_chart_without_points_is_none():
    canvas = canvas_of((0.1, 0.5), (10.0, 0.005), (10.0, 0.5))
    before = (canvas.pixels == 34).all(axis=2).sum()
    canvas.front([0, 1])
    assert (canvas.pixels == 34).all(axis=2).sum() - before > 800
    canvas_of().axes("time of a bake")
