"""Effects in a chart as a picture: error of what they draw against the time it takes, log-log. Only drawing needs matplotlib."""

from pathlib import Path

from .chart_picture import FAINT_INK, FONT, INK, LEAST, MARGIN, MARKERS, OKABE_ITO, log_ticks, place_labels, save_figure
from .pictures import WITHOUT, PictureChart


def draw_effects(pictures: PictureChart, scene: str, folder: Path) -> tuple[Path, Path]:
    """Draw ``effects.png`` and ``effects.svg`` into ``folder``: a panel an effect, its settings after all samples, and joined to
    them by faint lines where they were after fewer. Raises ImportError without matplotlib."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = pictures.effects()
    with mpl.rc_context({"font.size": FONT, "font.family": "DejaVu Sans", "axes.edgecolor": FAINT_INK, "text.color": INK,
                         "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK, "svg.fonttype": "none",
                         "svg.hashsalt": "rtgi"}):
        figure = Figure(figsize=(4.6 * len(names) + 0.6, 4.6), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(1, len(names), squeeze=False)[0]
        for axis, name, colour, marker in zip(axes, names, OKABE_ITO, MARKERS, strict=False):
            _draw(axis, pictures, name, colour, marker)
        width, height = pictures.size
        figure.suptitle(f"{scene}: {width} × {height} pixels through {pictures.camera}  ·  held to {pictures.reference['kind']}, "
                        f"its noise of {100 * pictures.reference['noise']:.2g} % taken out  ·  filled: defaults, faint: fewer "
                        "samples",
                        x=0.008, ha="left", fontsize=FONT)
        figure.canvas.draw()
        # Labels are placed on the layout as it is now.
        figure.set_layout_engine("none")
        for axis, name, colour in zip(axes, names, OKABE_ITO, strict=False):
            _label(axis, pictures.of(name), colour)
        png, svg = folder / "effects.png", folder / "effects.svg"
        save_figure(figure, png, dpi=160)
        save_figure(figure, svg, metadata={"Date": None})
    return png, svg


def _draw(axis, pictures: PictureChart, name: str, colour: str, marker: str) -> None:
    points = pictures.of(name)
    axis.set(xscale="log", yscale="log", xlabel="CPU time of the picture [s]", ylabel="relative RMSE of the picture [%]")
    axis.set_title(points[0].effect_label, loc="left", fontweight="bold")
    every = [(step.cpu_seconds, _shown(step.error)) for point in points for step in point.steps]
    for limits, values in ((axis.set_xlim, [of[0] for of in every]), (axis.set_ylim, [of[1] for of in every])):
        limits(min(values) / MARGIN, max(values) * MARGIN)
    for point in points:
        axis.plot(*zip(*((step.cpu_seconds, _shown(step.error)) for step in point.steps), strict=True), "-", color=colour,
                  linewidth=0.7, alpha=0.3, zorder=1)
        axis.plot(point.last.cpu_seconds, _shown(point.last.error), "x" if point.label == WITHOUT else marker, color=colour,
                  markersize=7, zorder=3, markerfacecolor=colour if point.default else "white", linestyle="none")
    floor = 100.0 * pictures.reference["floor"]
    low, high = axis.get_ylim()
    if floor > low:
        axis.axhspan(low, floor, color="#bbbbbb", alpha=0.35, linewidth=0, zorder=0)
        axis.set_ylim(low, high)
    log_ticks(axis)


def _label(axis, points, colour: str) -> None:
    place_labels(axis, [(point.last.cpu_seconds, _shown(point.last.error), point.label, colour,
                         not (point.default or point.label == WITHOUT)) for point in points])


def _shown(error: float) -> float:
    return 100.0 * max(error, LEAST)
