"""What a table of suns takes in the forms that it can be stored in, and what each loses: halves, and few vectors for many suns."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from .data import Transfer, stored_bytes
from .vectors import strongest

# Numbers of vectors that are tried, where the table has more directions.
VECTORS = (96, 64, 32)


@dataclass(frozen=True)
class StoredForm:
    """A ``form`` to store transfer in: ``bytes_per_probe`` of all of it, and the relative RMS ``error`` of the table of suns over
    all probes, coefficients and directions."""

    form: str
    bytes_per_probe: int
    error: float


def stored_forms(transfer: Transfer) -> tuple[StoredForm, ...]:
    """The forms that ``transfer`` can be stored in, the largest first."""
    directions, tables = len(transfer.sun_directions), [grid.suns for grid in transfer.grids]
    forms = [_form(transfer, "32 bits", False, 0, 0.0),
             _form(transfer, "16 bits", True, 0, table_error(tables, lambda plane: halves(plane).astype(np.float32)))]
    counts = [count for count in VECTORS if count < directions]
    most = strongest(tables, counts[0]) if counts else None
    for count in counts:
        vectors = most[:count]
        forms.append(_form(transfer, f"16 bits, suns by {count} vectors", True, count,
                           table_error(tables, lambda plane, by=vectors: halves(plane @ by.T).astype(np.float32) @ by)))
    return tuple(forms)


def _form(transfer: Transfer, name: str, half: bool, vectors: int, error: float) -> StoredForm:
    size = stored_bytes(transfer.order, transfer.sky_order, len(transfer.sun_directions), len(transfer.sites), len(transfer.lights),
                        half, vectors)
    return StoredForm(name, size, error)


def halves(values: np.ndarray) -> np.ndarray:
    """``values`` as float16, the largest of them where they are beyond."""
    largest = np.finfo(np.float16).max
    return np.clip(values, -largest, largest).astype(np.float16)


def table_error(tables: Iterable[np.ndarray], stored: Callable[[np.ndarray], np.ndarray]) -> float:
    """Relative RMS error of ``tables`` (3, …, K) of suns that are ``stored``(plane (…, K)), over all they hold."""
    off = power = 0.0
    for table in tables:
        for plane in table:
            off += float(np.square(stored(plane) - plane).sum(dtype=np.float64))
            power += float(np.square(plane).sum(dtype=np.float64))
    return float(np.sqrt(off / power)) if power else 0.0
