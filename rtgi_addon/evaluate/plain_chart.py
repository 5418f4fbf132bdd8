"""The chart where matplotlib is missing, as in Blender's own Python: error on surfaces against time, with the Pareto front and a
legend, in numpy alone. `chart_picture` draws more, and finer."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from ..storage.png import write_png
from .chart_data import Chart
from .dot_letters import dots
from .pictures import PictureChart

# Okabe and Ito's colours (2008), which hold for colour blindness; ink, and lines that stay behind.
_COLOURS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233), (0, 0, 0))
_INK, _FAINT, _PAPER = (34, 34, 34), (215, 215, 215), (255, 255, 255)
_SIZE, _LEFT, _RIGHT, _TOP, _BOTTOM = (1280, 800), 120, 40, 90, 150
_RADIUS, _DEFAULT_RADIUS, _SCALE = 6, 9, 2
# Axes go this factor beyond the outermost points; errors are drawn at this value at least.
_MARGIN, _LEAST = 1.5, 1e-4


def draw_plain_chart(chart: Chart, path: Path) -> Path:
    """Draw ``chart`` as the PNG ``path``. Raises BakeError for a disk that refuses."""
    # With a light atlas all are held to where it is read, for it is nowhere else.
    place = "atlas" if chart.measured("atlas") else "surface"
    points = chart.measured(place)
    canvas = _Canvas([(point.technique, point.seconds.mean, point.error(place), point.default) for point in points])
    canvas.axes("time of a bake")
    canvas.front([points.index(chart.points[index]) for index in chart.front("seconds", place)])
    where = "light on surfaces in the light atlas" if place == "atlas" else "light on surfaces"
    return canvas.written(path, f"{chart.scene}: {where} against time" + ("" if chart.complete else " (not complete)"),
                          "filled: defaults; black line: beaten by nothing in both")


def draw_plain_effects(pictures: PictureChart, scene: str, path: Path) -> Path:
    """Draw the pictures of effects as the PNG ``path``. Raises BakeError for a disk that refuses."""
    canvas = _Canvas([(point.effect, point.last.cpu_seconds, point.last.error, point.default) for point in pictures.points])
    canvas.axes("CPU time of a picture")
    return canvas.written(path, f"{scene}: error of the picture against time", "filled: defaults")


class _Canvas:
    """Pixels (h, w, 3) uint8 with logarithmic axes around ``rows``: group, seconds, error, and whether it is a default."""

    def __init__(self, rows: list[tuple[str, float, float, bool]]):
        width, height = _SIZE
        self.pixels = np.full((height, width, 3), _PAPER, np.uint8)
        self._rows, self._groups = rows, list(dict.fromkeys(row[0] for row in rows))
        self._times = np.array([max(seconds, 1e-6) for _, seconds, _, _ in rows] or [1.0])
        self._errors = np.array([max(error, _LEAST) for _, _, error, _ in rows] or [1.0])
        self._range = [(np.log10(values.min() / _MARGIN), np.log10(values.max() * _MARGIN))
                       for values in (self._times, self._errors)]

    def written(self, path: Path, title: str, legend: str) -> Path:
        """Draw the points, names and titles, and write it all."""
        for index, (group, _, _, default) in enumerate(self._rows):
            self.point(index, _COLOURS[self._groups.index(group) % len(_COLOURS)], default)
        for number, name in enumerate(self._groups):
            x = _LEFT + number * (_SIZE[0] - _LEFT - _RIGHT) // max(len(self._groups), 1)
            self.disc(x, _SIZE[1] - 40, _COLOURS[number % len(_COLOURS)], _DEFAULT_RADIUS, True)
            self.text(x + 20, _SIZE[1] - 48, name)
        self.text(_LEFT, 24, title)
        self.text(_LEFT, 52, legend)
        return write_png(path, self.pixels)

    def place(self, time: float, error: float) -> tuple[int, int]:
        """The pixel (x, y) of a time [s] and an error."""
        across, up = ((np.log10(value) - low) / (high - low) for value, (low, high) in zip((time, error), self._range, strict=True))
        return (round(_LEFT + across * (_SIZE[0] - _LEFT - _RIGHT)), round(_SIZE[1] - _BOTTOM - up * (_SIZE[1] - _TOP - _BOTTOM)))

    def axes(self, across: str) -> None:
        """Grid, ticks and what they mean; ``across`` is what takes the time."""
        (left, right), (low, high) = self._range
        for value in _ticks(left, right):
            x, _ = self.place(value, 10.0**low)
            self.pixels[_TOP:_SIZE[1] - _BOTTOM, x] = _FAINT
            self.text(x, _SIZE[1] - _BOTTOM + 12, f"{value:g} s", centred=True)
        for value in _ticks(low, high):
            _, y = self.place(10.0**left, value)
            self.pixels[y, _LEFT:_SIZE[0] - _RIGHT] = _FAINT
            self.text(10, y - 8, f"{100 * value:g} %")
        self.pixels[_TOP:_SIZE[1] - _BOTTOM, _LEFT] = self.pixels[_SIZE[1] - _BOTTOM, _LEFT:_SIZE[0] - _RIGHT] = _INK
        self.text((_LEFT + _SIZE[0] - _RIGHT) // 2, _SIZE[1] - _BOTTOM + 44, across, centred=True)

    def front(self, indices: list[int]) -> None:
        """A line through the points that nothing beats."""
        corners = sorted(self.place(self._times[index], self._errors[index]) for index in indices)
        for (x0, y0), (x1, y1) in pairwise(corners):
            steps = max(abs(x1 - x0), abs(y1 - y0), 1)
            x, y = (np.rint(np.linspace(*ends, steps + 1)).astype(int) for ends in ((x0, x1), (y0, y1)))
            for shift in (0, 1):
                self.pixels[np.clip(y + shift, 0, _SIZE[1] - 1), x] = _INK

    def point(self, index: int, colour, default: bool) -> None:
        """A setting: filled where it is its technique's default."""
        self.disc(*self.place(self._times[index], self._errors[index]), colour, _DEFAULT_RADIUS if default else _RADIUS, default)

    def disc(self, x: int, y: int, colour, radius: int, filled: bool) -> None:
        """A disc, or a ring."""
        rows, columns = np.ogrid[-radius:radius + 1, -radius:radius + 1]
        distance = np.hypot(rows, columns)
        shape = (distance <= radius) if filled else (distance <= radius) & (distance >= radius - 2.5)
        part = self.pixels[y - radius:y + radius + 1, x - radius:x + radius + 1]
        part[shape[:part.shape[0], :part.shape[1]]] = colour

    def text(self, x: int, y: int, text: str, centred: bool = False) -> None:
        """Letters from (x, y), their upper left corner, on; what goes beyond the picture is cut."""
        image = dots(text, _SCALE)
        x = max(x - image.shape[1] // 2, 0) if centred else x
        part = self.pixels[y:y + image.shape[0], x:x + image.shape[1]]
        part[image[:part.shape[0], :part.shape[1]]] = _INK


def _ticks(low: float, high: float) -> list[float]:
    """1, 2 and 5 of every decade between the logarithms ``low`` and ``high``; 1 alone where that would be many."""
    steps = (1, 2, 5) if high - low < 2.5 else (1,)
    values = [step * 10.0**decade for decade in range(int(np.floor(low)), int(np.ceil(high)) + 1) for step in steps]
    return [value for value in values if low <= np.log10(value) <= high]
