"""A chart as Markdown: every figure, and what each technique has to offer at equal time and at equal error."""

from .chart_data import MEBIBYTE, Chart, Point
from .pareto import best_within, cheapest_within, round_steps
from .pictures import BLOCK, SAMPLES, WITHOUT
from .statistics import Interval

# Rows of the equal-time and equal-error tables at most.
MOST_ROWS = 9
ERROR_STEPS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)


def markdown(chart: Chart, pictures: tuple[str, ...] = ()) -> str:
    """The whole report; ``pictures`` are file names to show, those that were drawn."""
    reference, receivers = chart.reference, chart.receivers
    left_out = ["## Left out", *(f"- {line}" for line in chart.left_out)] if chart.left_out else []
    if not chart.points:
        cancelled = [] if chart.complete else ["**Cancelled before the end: not every picture is there.**"]
        parts = [f"# {chart.scene}: speed against accuracy", *cancelled, *_effects(chart), *left_out]
        return "\n\n".join(parts).replace("\n\n- ", "\n- ") + "\n"
    parts = [
        f"# {chart.scene}: speed against accuracy",
        *([] if chart.complete else ["**Cancelled before the end: not every setting has every seed.**"]),
        f"Errors are relative RMSE of irradiance against a {reference['kind']} reference (its own noise of "
        f"{_percent(reference['noise'])} is subtracted) at {receivers['points']} surface points under their own normals, and just "
        f"above each under {receivers['normals'] - 1} other{'s' * (receivers['normals'] != 2)}. Errors below "
        f"{_percent(chart.floor)} cannot be told from none. {chart.seeds} seed{'s' * (chart.seeds > 1)}; ± and ranges are 95 % "
        f"confidence intervals. Times are wall clock on {chart.machine['cores']} cores"
        + (f" with {chart.threads} threads" if chart.threads else "") + ".",
        *(f"![{name}]({name})" for name in pictures),
        *_techniques(chart), *_known(chart), *_leaks(chart), *_atlas(chart), *_stored(chart), *_effects(chart),
        *left_out,
    ]
    return "\n\n".join(parts).replace("\n\n- ", "\n- ") + "\n"


def _techniques(chart: Chart) -> list[str]:
    if not chart.measured("surface"):
        return []
    return [
        "## Every setting", _settings_table(chart),
        "*Surface*: the technique's own light at all receivers; *own normals*: of these, only on surfaces under their own normal; "
        "*shipped*: all receivers lit by the baked probes, as in an engine; *probes*: SH at the probes, nothing interpolated; "
        "*systematic* and *noise*: what all seeds have in common of the surface error, and what differs between them. *Memory*: "
        "the bake's peak above what was held before. *Look-up*: one surface point of the technique's own field, on the CPU.",
        "## At equal time", "The least surface error that a technique reaches within the time; only measured settings, nothing "
        "interpolated.", _equal_time(chart),
        "## At equal error", "The least time in which a technique reaches the error.", _equal_error(chart)]


def summary(chart: Chart) -> str:
    """A few lines for a terminal: the Pareto front; "" without techniques."""
    if not chart.points:
        return ""
    lines = []
    for place, where in (("surface", ""), ("atlas", ", on surfaces in the light atlas")):
        front = [chart.points[index] for index in chart.front("seconds", place)]
        lines += [f"  time      error    the least time for this error{where}"] if front else []
        lines += [f"  {_seconds(point.seconds.mean):>8}  {_percent(point.error(place)):>7}  {point.technique}, {point.label}"
                  for point in front]
    return "\n".join(lines)


def picture_summary(chart: Chart) -> str:
    """A few lines for a terminal: each effect at its defaults and the picture without it; "" if no effect was measured."""
    if chart.pictures is None:
        return ""
    lines = [f"  CPU time  error    of the picture, {SAMPLES} samples, against {chart.pictures.reference['kind']}"]
    for point in chart.pictures.points:
        if point.default or point.label == WITHOUT:
            time, error = _seconds(point.last.cpu_seconds), _percent(point.last.error)
            lines.append(f"  {time:>8}  {error:>7}  {point.effect}, {point.label}")
    return "\n".join(lines)


def _effects(chart: Chart) -> list[str]:
    pictures = chart.pictures
    if pictures is None:
        return []
    width, height = pictures.size
    reference = pictures.reference
    parts = ["## Effects", "![effects.png](effects.png)",
             f"Errors of the picture through {pictures.camera}, {width} × {height} pixels: relative RMSE of all pixels "
             f"against {reference['kind']}, whose own noise of {_percent(reference['noise'])} a pixel is taken out; below about "
             f"{_percent(reference['floor'])} they cannot be told from none. *Coarse* is that of means over {BLOCK} × {BLOCK} "
             "pixels. Times are wall clock from the scene to the picture, what an effect prepares included, and no bake: "
             "effects that "
             "do not light surfaces themselves have probes at their defaults."]
    rows = []
    for point in pictures.points:
        rows.append([point.effect, f"**{point.label}**" if point.default else point.label,
                     *(_percent(step.error) for step in point.steps), _percent(point.coarse),
                     f"{100 * point.last.bias:+.1f} %", _seconds(point.last.seconds), _seconds(point.last.cpu_seconds)])
    counts = [f"{step.samples} sample{'s' * (step.samples > 1)}" for step in pictures.points[0].steps]
    return [*parts, _table(["effect", "setting", *counts, "coarse", "bias", "time", "CPU time"], rows, 2)]


def _settings_table(chart: Chart) -> str:
    front = set(chart.front())
    rows = []
    for index, point in enumerate(chart.points):
        if "surface" not in point.accuracy:
            continue
        surface = point.accuracy["surface"]
        rows.append([
            point.technique, point.label + (" ◆" if index in front else ""), _range(point.seconds, _seconds),
            _seconds(point.cpu_seconds.mean), f"{point.rays.mean / 1e6:.2f}",
            "–" if point.peak_bytes is None else f"{point.peak_bytes.mean / MEBIBYTE:.0f}", f"{1e6 * point.lookup_seconds:.0f}",
            _range(surface.spread.error, _percent), _signed(surface.bias), _percent(surface.spread.systematic),
            _percent(surface.spread.random), f"{surface.energy:.3f}", f"{surface.relmse:.3g}",
            *(_percent(point.error(place)) for place in ("own_normals", "shipped", "probes"))])
    heads = ["technique", "setting (◆ on the Pareto front)", "time", "CPU time", "rays [M]", "memory [MiB]",
             "look-up [µs]", "surface error", "bias", "systematic", "noise", "energy", "relMSE", "own normals", "shipped", "probes"]
    return _table(heads, rows, 2)


def _equal_time(chart: Chart) -> str:
    times = [point.seconds.mean for point in chart.measured("surface")]
    steps = _thinned(round_steps(min(times), max(times)))

    def cell(points: list[Point], budget: float) -> str:
        index = best_within([point.seconds.mean for point in points], [point.error() for point in points], budget)
        return "–" if index is None else f"{_percent(points[index].error())} ({points[index].label})"

    return _by_technique(chart, "within", [(step, _seconds(step)) for step in steps], cell)


def _equal_error(chart: Chart) -> str:
    errors = [max(point.error(), 1e-4) for point in chart.measured("surface")]
    steps = _thinned(round_steps(min(errors), max(errors), ERROR_STEPS))

    def cell(points: list[Point], target: float) -> str:
        index = cheapest_within([point.seconds.mean for point in points], [point.error() for point in points], target)
        return "–" if index is None else f"{_seconds(points[index].seconds.mean)} ({points[index].label})"

    return _by_technique(chart, "at most", [(step, _percent(step)) for step in reversed(steps)], cell)


def _by_technique(chart: Chart, head: str, steps, cell) -> str:
    names = chart.techniques("surface")
    groups = {name: [point for point in chart.points if point.technique == name] for name in names}
    return _table([head, *names], [[text, *(cell(groups[name], step) for name in names)] for step, text in steps], 1)


def _known(chart: Chart) -> list[str]:
    rows = [[point.technique, point.label, _range(known.spread.error, _percent), _signed(known.bias), f"{known.energy:.3f}"]
            for point in chart.points if (known := point.accuracy.get("known"))]
    if not rows:
        return []
    return ["## Against what a technique knows",
            "These techniques hold a part of the light by design; here their reference is that part "
            "alone, by the path tracer.", _table(["technique", "setting", "error", "bias", "energy"], rows, 2)]


def _leaks(chart: Chart) -> list[str]:
    rows = [[point.technique, point.label, f"{surface.leak:.2g}", f"{shipped.leak:.2g}", f"{surface.true_leak:.2g}"]
            for point in chart.measured("surface")
            if (surface := point.accuracy["surface"]).leak is not None and (shipped := point.accuracy["shipped"]).leak is not None]
    if not rows:
        return []
    return ["## Leaks",
            f"Mean irradiance of the {chart.receivers['dark']} dark receivers (less than a hundredth of the mean) relative to "
            "that of the others.", _table(["technique", "setting", "surface", "shipped", "exact"], rows, 2)]


def _atlas(chart: Chart) -> list[str]:
    points = chart.measured("atlas")
    if not points:
        return []
    front, rows = [chart.points[index] for index in chart.front("seconds", "atlas")], []
    for point in points:
        found, best = point.accuracy["atlas"], any(point is other for other in front)
        rows.append([point.technique, point.label + " ◆" * best, _range(point.seconds, _seconds),
                     _seconds(point.cpu_seconds.mean), f"{point.field_bytes / MEBIBYTE:.2f}", _range(found.spread.error, _percent),
                     _signed(found.bias)])
    return ["## Light atlas",
            f"At the {chart.receivers['atlas']} of these points that lie on surfaces in the light atlas, under their own normals: "
            "the atlas at several densities, and there each technique's own light.",
            _table(["", "setting (◆ on the Pareto front)", "time", "CPU time", "size [MiB]", "error", "bias"], rows, 2)]


def _stored(chart: Chart) -> list[str]:
    rows = [[point.technique, form["form"], f"{form['bytes_per_probe']:,}", _percent(form["error"])]
            for point in chart.points for form in point.stored]
    if not rows:
        return []
    return ["## Stored", "What a probe takes in the forms that its light can be stored in, and the relative RMS error of what suns "
            "from all directions give by them.", _table(["technique", "form", "bytes a probe", "error of suns"], rows, 2)]


def _table(heads: list[str], rows: list[list[str]], text_columns: int) -> str:
    rule = ["---" if column < text_columns else "---:" for column in range(len(heads))]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [heads, rule, *rows])


def _thinned(steps: list[float]) -> list[float]:
    """At most MOST_ROWS of ``steps``, the last one among them."""
    stride = -(-len(steps) // MOST_ROWS)
    return steps[::-1][::stride][::-1]


def _percent(value: float | None) -> str:
    if value is None:
        return "–"
    return f"{100 * value:.2g} %" if value < 0.0995 else f"{100 * value:.0f} %"


def _seconds(value: float) -> str:
    return f"{1000 * value:.0f} ms" if value < 0.0995 else f"{value:.2f} s" if value < 9.95 else f"{value:,.0f} s"


def _range(value: Interval, text) -> str:
    if value.low is None or text(value.low) == text(value.high):
        return text(value.mean)
    return f"{text(value.mean)} ({text(value.low)} – {text(value.high)})"


def _signed(value: Interval) -> str:
    half = None if value.low is None else 50 * (value.high - value.low)
    half = "" if half is None or half < 0.005 else f" ± {half:.2g}"
    return (f"{100 * value.mean:+.2g}" if abs(value.mean) < 0.0995 else f"{100 * value.mean:+.0f}") + f"{half} %"
