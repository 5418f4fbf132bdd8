"""How far a job is, in words for the panel and the status bar."""

from bpy.app.translations import pgettext_iface as iface_

from ..translations import sentence
from ..worker import Report, duration


def bar_text(report: Report, stopping: bool) -> str:
    """What stands in a progress bar: the share that is done, and the time left."""
    if stopping:
        return iface_("Cancelling…")
    if report.seconds_left is None:
        return f"{100 * report.fraction:.0f}%"
    return iface_("{share}%  ·  {time} left").format(share=f"{100 * report.fraction:.0f}", time=duration(report.seconds_left))


def step_text(report: Report) -> str:
    """What the job does now."""
    label = sentence(report.label) or iface_("Starting")
    return label[:1].upper() + label[1:]


def progress_parts(report: Report) -> list[str]:
    """What the job does, how far it is, and the time left."""
    parts = [f"{100 * report.fraction:.0f}%"]
    if report.label:
        parts.insert(0, step_text(report))
    if report.seconds_left is not None:
        parts.append(iface_("{time} left").format(time=duration(report.seconds_left)))
    return parts


def status_text(report: Report, stopping: bool) -> str:
    """A line for the status bar."""
    if stopping:
        return iface_("RTGI: cancelling…")
    return iface_("RTGI: {progress}  |  Esc to cancel").format(progress=", ".join(progress_parts(report)))
