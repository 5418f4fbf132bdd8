"""A chart as a picture: error against time, rays and memory, log-log, with the Pareto front; and a sheet of error maps.

Only this module needs matplotlib, and only when it draws. Colours are Okabe and Ito's (2008), which hold for colour blindness;
each technique has a marker of its own as well.
"""

import io
from pathlib import Path

import numpy as np

from ..storage.files import disk_error
from ..storage.writing import write_file
from .chart_data import MEBIBYTE, Chart, Point
from .error_map import COLOURS, FULL_SCALE

HOW_TO_GET_PICTURES = "chart.png is a plain one, without matplotlib: `pip install matplotlib` for this Python for more of it"
OKABE_ITO = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = "oD^svP*"
INK, FAINT_INK = "#222222", "#777777"
FONT = 8.5
# Where a label may stand about its point: offsets [points] and alignments, in order of preference.
PLACES = ((6, 5, "left", "bottom"), (6, -5, "left", "top"), (-6, 5, "right", "bottom"), (-6, -5, "right", "top"),
          (0, 8, "center", "bottom"), (0, -8, "center", "top"), (6, 14, "left", "bottom"), (6, -14, "left", "top"),
          (-6, 14, "right", "bottom"), (-6, -14, "right", "top"), (14, 24, "left", "bottom"), (14, -24, "left", "top"))
# Errors are drawn at this value at least: 0 has no place on a logarithmic axis.
LEAST = 1e-4
# Axes go this factor beyond the outermost points, and span this factor at least.
MARGIN, LEAST_SPAN = 1.6, 5.0
# Bars reach down to this share of their point at most: towards 0 a logarithmic axis has no end.
SHORTEST = 0.05
# An axis of fewer decades has ticks at 1, 2 and 5, one of more than the second number at 1 alone, others at 1 and 3.
FEW_DECADES, MANY_DECADES = 2.2, 3.5
# Side of the square about a point that labels keep off [points].
POINT_SIDE = 10
# A label this far from its point [points] or less needs no line to it.
NEAR_LABEL = 10


def can_draw() -> bool:
    """Whether matplotlib is there."""
    try:
        from matplotlib import figure  # noqa: F401
    except ImportError:
        return False
    return True


def draw_chart(chart: Chart, folder: Path) -> tuple[Path, Path]:
    """Draw ``chart.png`` and ``chart.svg`` into ``folder``. Raises ImportError without matplotlib."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    style = {"font.size": FONT, "font.family": "DejaVu Sans", "axes.edgecolor": FAINT_INK, "axes.linewidth": 0.7,
             "text.color": INK, "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK, "svg.fonttype": "none",
             "svg.hashsalt": "rtgi", "xtick.major.width": 0.7, "ytick.major.width": 0.7}
    with mpl.rc_context(style):
        # One more column where there is a light atlas.
        wide = bool(chart.measured("atlas"))
        figure = Figure(figsize=(14.4 if wide else 11.5, 6.3), layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(2, 5 if wide else 4)
        main = figure.add_subplot(grid[:, :2])
        _draw_panel(main, chart, "seconds", "surface")
        main.set_title("Light on surfaces against time", loc="left", fontweight="bold")
        for place, cost, cell, title in (("surface", "rays", grid[0, 2], "… against rays"),
                                         ("surface", "peak_bytes", grid[0, 3], "… against memory"),
                                         ("shipped", "seconds", grid[1, 2], "Surfaces lit by the baked probes"),
                                         ("probes", "seconds", grid[1, 3], "At the probes themselves")):
            axis = figure.add_subplot(cell)
            _draw_panel(axis, chart, cost, place, small=True)
            axis.set_title(title, loc="left", fontweight="bold", fontsize=FONT)
        if wide:
            axis = figure.add_subplot(grid[:, 4])
            _draw_panel(axis, chart, "seconds", "atlas", small=True)
            axis.set_title("Surfaces in the light atlas", loc="left", fontweight="bold", fontsize=FONT)
        figure.suptitle(_title(chart), x=0.008, ha="left", fontsize=FONT)
        handles = _legend_entries(chart)
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=FONT - 0.5,
                      columnspacing=1.4, handletextpad=0.4, handlelength=1.6)
        figure.canvas.draw()
        # Labels are placed on the layout as it is now.
        figure.set_layout_engine("none")
        _place_labels(main, chart)
        png, svg = folder / "chart.png", folder / "chart.svg"
        save_figure(figure, png, dpi=160)
        save_figure(figure, svg, metadata={"Date": None})
    return png, svg


def draw_error_sheet(path: Path, pictures: list[tuple[str, np.ndarray]]) -> Path:
    """Draw ``pictures`` (title, (h, w, 3) in 0…1) side by side with the scale of their colours. Raises ImportError."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import LinearSegmentedColormap, Normalize
    from matplotlib.figure import Figure

    columns = min(3, len(pictures))
    rows = -(-len(pictures) // columns)
    height, width = pictures[0][1].shape[:2]
    with mpl.rc_context({"font.size": FONT, "font.family": "DejaVu Sans", "text.color": INK}):
        figure = Figure(figsize=(3.8 * columns, (3.8 * height / width + 0.35) * rows + 0.6), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for axis in axes:
            axis.set_axis_off()
        for axis, (title, picture) in zip(axes, pictures, strict=False):
            axis.imshow(picture, interpolation="nearest")
            axis.set_title(title, loc="left", fontsize=FONT)
        scale = mpl.cm.ScalarMappable(Normalize(-100 * FULL_SCALE, 100 * FULL_SCALE),
                                      LinearSegmentedColormap.from_list("error", COLOURS))
        bar = figure.colorbar(scale, ax=axes.tolist(), orientation="horizontal", fraction=0.05, aspect=60, pad=0.02, extend="both")
        bar.set_label("error of irradiance [%]: blue is too dark, red too bright")
        bar.outline.set_visible(False)
        save_figure(figure, path, dpi=130)
    return path


def save_figure(figure, path: Path, **options) -> None:
    """By way of memory, so that the file is whole or not there. Raises BakeError."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=path.suffix[1:], **options)
    try:
        write_file(path, buffer.getvalue())
    except OSError as error:
        raise disk_error(path, error) from error


def _draw_panel(axis, chart: Chart, cost: str, place: str, small: bool = False) -> None:
    """One log-log panel: points with their intervals, a technique's on the scene's own lattice joined by cost, and the front."""
    factor = {"peak_bytes": 1 / MEBIBYTE, "rays": 1e-6}.get(cost, 1.0)
    known = [point for point in chart.points if point.cost(cost) and place in point.accuracy]
    if not known:
        axis.text(0.5, 0.5, "not measured", transform=axis.transAxes, ha="center", va="center", color=FAINT_INK)
        axis.set(xticks=[], yticks=[])
        return
    axis.set(xscale="log", yscale="log")
    for name in chart.techniques():
        points = sorted((point for point in known if point.technique == name), key=lambda point: point.cost(cost))
        if not points:
            continue
        colour, marker = _look(chart, name)
        x = np.array([point.cost(cost) * factor for point in points])
        y = np.array([_shown_error(point, place) for point in points])
        joined = np.array([point.lattice == 1.0 for point in points])
        axis.plot(x[joined], y[joined], "-", color=colour, linewidth=0.8, alpha=0.45, zorder=2)
        for values, intervals, direction in ((x, [getattr(point, cost) for point in points], "x"),
                                             (y, [point.accuracy[place].spread.error for point in points], "y")):
            scale = factor if direction == "x" else 100.0
            bars = np.array([[0.0, 0.0] if around.low is None else [max(value - max(around.low * scale, SHORTEST * value), 0.0),
                                                                    max(around.high * scale - value, 0.0)]
                             for value, around in zip(values, intervals, strict=True)]).T
            axis.errorbar(x, y, **{f"{direction}err": bars}, fmt="none", ecolor=colour, elinewidth=0.8, alpha=0.6, zorder=2)
        size = 4.5 if small else 7
        filled = np.array([point.default for point in points])
        axis.plot(x[filled], y[filled], marker, color=colour, markersize=size, markeredgecolor="white", markeredgewidth=0.4,
                  linestyle="none", zorder=4)
        axis.plot(x[~filled], y[~filled], marker, markerfacecolor="white", markeredgecolor=colour, markersize=size - 0.5,
                  markeredgewidth=1.2, linestyle="none", zorder=3)
    front = [chart.points[index] for index in chart.front(cost, place)]
    if front:
        x = [point.cost(cost) * factor for point in front]
        y = [_shown_error(point, place) for point in front]
        axis.step(x, y, where="post", color=INK, linewidth=1.2 if small else 1.6, zorder=1.5, alpha=0.8)
    _finish_axes(axis, chart, cost, place, np.array([point.cost(cost) * factor for point in known]),
                 np.array([_shown_error(point, place) for point in known]))


def _finish_axes(axis, chart: Chart, cost: str, place: str, x: np.ndarray, y: np.ndarray) -> None:
    """Scales, ticks and labels about the points ``x``, ``y`` (n,)."""
    axis.set_xlabel({"seconds": "bake [s]", "rays": "rays [million]", "peak_bytes": "peak memory of the bake [MiB]"}[cost])
    axis.set_ylabel("relative RMSE [%]")
    for values, set_limits in ((x, axis.set_xlim), (y, axis.set_ylim)):
        low, high = values.min(), values.max()
        # Points decide, not the ends of long bars; and some span there must be, or what is flat would look steep.
        grow = max(MARGIN, (LEAST_SPAN * low / high) ** 0.5)
        set_limits(low / grow, high * grow)
    low, high = axis.get_ylim()
    if place != "probes" and 100 * chart.floor > low:
        axis.axhspan(low, 100 * chart.floor, color="#bbbbbb", alpha=0.35, linewidth=0, zorder=0)
        axis.set_ylim(low, high)
    log_ticks(axis)


def log_ticks(axis) -> None:
    """Ticks of both logarithmic axes as plain numbers, and a grid."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    for scale in (axis.xaxis, axis.yaxis):
        ends = scale.get_view_interval()
        decades = np.log10(ends[1] / ends[0])
        ticks = (1.0, 2.0, 5.0) if decades < FEW_DECADES else (1.0,) if decades > MANY_DECADES else (1.0, 3.0)
        scale.set_major_locator(LogLocator(subs=ticks))
        scale.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        scale.set_minor_locator(NullLocator())
    axis.grid(True, which="major", color="#dddddd", linewidth=0.6, zorder=0)
    axis.set_axisbelow(True)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)


def _place_labels(axis, chart: Chart) -> None:
    """Label every point of the main panel, front and defaults first."""
    front = set(chart.front())
    place_labels(axis, [(point.seconds.mean, _shown_error(point, "surface"), point.label, _look(chart, point.technique)[0],
                         (index not in front, not point.default))
                        for index, point in enumerate(chart.points) if "surface" in point.accuracy])


def place_labels(axis, entries: list[tuple]) -> None:
    """Write the labels of ``entries``, (x, y, text, colour, rank), where each overlaps neither a point nor another label; leave out
    those that find no place, the highest ranks first."""
    from matplotlib.patheffects import withStroke
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

    renderer = axis.figure.canvas.get_renderer()
    frame = axis.get_window_extent(renderer)
    pixels = axis.figure.dpi / 72.0
    side = POINT_SIDE * pixels
    taken = [Bbox.from_bounds(x - side / 2, y - side / 2, side, side) for x, y in
             (axis.transData.transform(entry[:2]) for entry in entries)]
    line = {"arrowstyle": "-", "color": FAINT_INK, "linewidth": 0.4}
    for index in sorted(range(len(entries)), key=lambda index: entries[index][4]):
        x, y, label, colour, _ = entries[index]
        for dx, dy, horizontal, vertical in PLACES:
            text = axis.annotate(label, (x, y), (dx, dy), textcoords="offset points", ha=horizontal, va=vertical, fontsize=FONT - 1,
                                 color=colour, zorder=5, path_effects=[withStroke(linewidth=2, foreground="white")],
                                 arrowprops=line if abs(dy) > NEAR_LABEL else None)
            # Of the words alone: an annotation counts the line to its point as well.
            text.update_positions(renderer)
            box = Text.get_window_extent(text, renderer).padded(1.5 * pixels)
            clear = not any(other.overlaps(box) for number, other in enumerate(taken) if number != index)
            if clear and frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1:
                taken.append(box)
                break
            text.remove()


def _legend_entries(chart: Chart) -> list:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    labels = {point.technique: point.technique_label for point in chart.points}
    entries = [Line2D([], [], color=_look(chart, name)[0], marker=_look(chart, name)[1], linestyle="none", markersize=6,
                      label=labels[name]) for name in chart.techniques()]
    entries.append(Line2D([], [], color=INK, linewidth=1.6, label="Pareto front"))
    entries.append(Line2D([], [], marker="o", linestyle="none", markerfacecolor="white", markeredgecolor=INK,
                          label="filled: defaults"))
    entries.append(Patch(color="#bbbbbb", alpha=0.35, linewidth=0, label="noise of the reference"))
    return entries


def _title(chart: Chart) -> str:
    reference, receivers = chart.reference, chart.receivers
    parts = [f"{chart.scene}: {receivers['probes_in_all']:,} probes",
             f"{receivers['points']} surface points under {receivers['normals']} normals",
             f"{reference['kind']} reference, its noise of {100 * reference['noise']:.2g} % subtracted",
             f"{chart.seeds} seed{'s' * (chart.seeds > 1)}, bars: 95 % confidence" if chart.seeds > 1 else "1 seed"]
    return ("" if chart.complete else "INCOMPLETE  ·  ") + "  ·  ".join(parts)


def _look(chart: Chart, name: str) -> tuple[str, str]:
    """Colour and marker of a technique: the same in every chart that has the same techniques."""
    order = {"probes": 0, "vpl": 1, "rsm": 2, "lpv": 3}
    others = sorted(set(chart.techniques()) - set(order))
    number = order[name] if name in order else len(order) + others.index(name)
    return OKABE_ITO[number % len(OKABE_ITO)], MARKERS[number % len(MARKERS)]


def _shown_error(point: Point, place: str) -> float:
    """Error [%] as it is drawn."""
    return 100.0 * max(point.error(place), LEAST)
