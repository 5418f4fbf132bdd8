"""What the tools of the 3D view's sidebar share: where their panels stand, and their rows. A job's button, progress, cancel and
error look the same whatever it works on."""

import textwrap
from collections.abc import Callable

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..session import Finding
from ..translations import sentence
from ..worker import Job
from .progress_text import bar_text, step_text
from .select_named import SEPARATOR

# Mean width of a letter of the interface's font, and what icon and margins take of a line [px]; how few letters go on a line
# however narrow the region is.
_LETTER, _MARGINS, _FEWEST_LETTERS = 6.6, 60, 24
# Height of a line of running text, and the share of a table's width that the first of two values takes.
_LINE_HEIGHT, _VALUE_SHARE = 0.8, 0.5


def draw_lines(layout, text: str, width: int, icon: str = "NONE", selects: Finding | None = None) -> None:
    """``text``, in the user's language already, over as many labels as a region of ``width`` pixels needs; the icon stands before
    the first. A click on any of them selects what ``selects`` is about."""
    scale = bpy.context.preferences.system.ui_scale or 1.0  # 0 without a window
    characters = max(int((width - _MARGINS) / (_LETTER * scale)), _FEWEST_LETTERS)
    column = layout.column(align=True)
    column.scale_y = _LINE_HEIGHT
    for number, line in enumerate(textwrap.wrap(text, characters) or [""]):
        shown = icon if number == 0 else ("NONE" if icon == "NONE" else "BLANK1")
        if selects is None or not (selects.objects or selects.materials):
            column.label(text=line, translate=False, icon=shown)
            continue
        row = column.row()
        row.alignment = "LEFT"
        button = row.operator("rtgi.select_named", text=line, translate=False, icon=shown, emboss=False)
        button.objects, button.materials = SEPARATOR.join(selects.objects), SEPARATOR.join(selects.materials)


def draw_table(layout, error: str, rows: list[tuple[bool, str, str, str]], icon: str) -> None:
    """A table of settings: name, error (``error`` is its heading) and time; ``icon`` before those that are marked."""
    column = layout.column(align=True)
    for marked, name, value, time in [(False, iface_("Setting"), error, iface_("Time")), *rows]:
        # Over each other: beside each other names are cut where they begin to differ.
        column.label(text=name, translate=False, icon=icon if marked else "BLANK1")
        cells = column.split(factor=_VALUE_SHARE)
        cells.label(text=value, translate=False, icon="BLANK1")
        cells.label(text=time, translate=False)


def draw_job(layout, context, job: Job, buttons: Callable, cancel: str, scale: float = 1.0) -> None:
    """``buttons(layout)`` that start ``job`` and why its last attempt failed; while it runs, how far it is and the button of the
    operator ``cancel``. ``scale`` is the height of the rows."""
    if not job.running:
        column = layout.column()
        column.scale_y = scale
        buttons(column)
        error = job.errors.get(context.scene.name)
        if error:
            box = layout.box()
            box.alert = True
            draw_lines(box, sentence(error), context.region.width, "CANCEL")
        return
    report, stopping = job.worker.report, job.worker.progress.cancelled
    row = layout.row(align=True)
    row.scale_y = scale
    row.progress(factor=report.fraction, type="BAR", text=bar_text(report, stopping), translate=False)
    button = row.row(align=True)
    button.enabled = not stopping
    button.operator(cancel, text="", icon="CANCEL")
    step = step_text(report)
    draw_lines(layout, step if job.scene == context.scene.name else f"{job.scene}: {step}", context.region.width, "SORTTIME")
