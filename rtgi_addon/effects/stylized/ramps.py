"""Ramps as a line of text, which settings, presets and files can hold, and as the table that both halves read."""

import numpy as np

from ...errors import UsageError

# Samples from 0 to 1, both ends among them.
SIZE = 64


def parse_ramp(text: str) -> tuple[list[float], np.ndarray, bool]:
    """Positions in [0, 1], ascending, their colours (n, 3), and whether colours hold until the next stop, of a text like
    ``constant 0:0.1,0.1,0.3 0.5:1,1,1``; a single number stands for a grey. Raises UsageError."""
    words = text.replace(";", " ").split()
    constant = bool(words) and words[0].lower() == "constant"
    stops = []
    for word in words[1:] if constant else words:
        place, colon, colour = word.partition(":")
        try:
            values = [float(part) for part in colour.split(",")]
            position = float(place)
        except ValueError:
            values, position = [], -1.0
        if not colon or len(values) not in (1, 3) or not 0.0 <= position <= 1.0 or not np.all(np.isfinite(values)):
            raise UsageError(f"{word!r} is no stop of a ramp", "write position:red,green,blue with a position from 0 to 1")
        stops.append((position, values * 3 if len(values) == 1 else values))
    if not stops:
        return [0.0, 1.0], np.array([[0.0] * 3, [1.0] * 3]), False
    stops.sort(key=lambda stop: stop[0])
    return [position for position, _ in stops], np.maximum([colour for _, colour in stops], 0.0), constant


def format_ramp(positions, colours, constant: bool = False) -> str:
    """The text that ``parse_ramp`` reads as this ramp."""
    stops = (f"{position:.4g}:" + ",".join(f"{value:.4g}" for value in colour)
             for position, colour in zip(positions, colours, strict=True))
    return " ".join(["constant"] * constant + list(stops))


def ramp_table(text: str) -> np.ndarray:
    """The ramp of ``text`` as (SIZE, 3) float32. Raises UsageError."""
    positions, colours, constant = parse_ramp(text)
    places = np.linspace(0.0, 1.0, SIZE)
    if constant:
        # A stop holds from where it stands on.
        index = np.clip(np.searchsorted(positions, places + 1e-9, side="right") - 1, 0, len(positions) - 1)
        return colours[index].astype(np.float32)
    return np.stack([np.interp(places, positions, colours[:, channel]) for channel in range(3)], axis=1).astype(np.float32)


def look_up(table: np.ndarray, tone: np.ndarray) -> np.ndarray:
    """Colours (n, 3) of the ramp ``table`` at ``tone`` (n,), which is held to [0, 1], linear between samples."""
    place = np.clip(tone, 0.0, 1.0) * np.float32(SIZE - 1)
    low = np.minimum(place.astype(np.int32), SIZE - 2)
    share = (place - low)[:, None]
    return table[low] * (1 - share) + table[low + 1] * share
