"""A table of suns as products with few vectors that all probes share: its strongest principal components.

Neighbouring directions light much the same strip of wall, so that a table of hundreds has the content of fewer. After P.-P. Sloan,
J. Hall, J. Hart and J. Snyder, "Clustered Principal Components for Precomputed Radiance Transfer", SIGGRAPH 2003, with one cluster;
what it loses by number is in docs/techniques/transfer.md.
"""

from collections.abc import Sequence

import numpy as np

# Rows that are taken to float64 at a time.
_ROWS = 1 << 15


def strongest(tables: Sequence[np.ndarray], count: int) -> np.ndarray:
    """The ``count`` orthonormal vectors (count, K) float32 for which rows of ``tables`` (…, K) are nearest, in squares, to sums of
    products with them."""
    gram = np.zeros((tables[0].shape[-1],) * 2)
    for table in tables:
        rows = table.reshape(-1, len(gram))
        for first in range(0, len(rows), _ROWS):
            part = rows[first:first + _ROWS].astype(np.float64)
            gram += part.T @ part
    found = np.linalg.eigh(gram)[1][:, :-count - 1:-1].T
    # Of two signs always the same.
    largest = np.abs(found).argmax(axis=1)[:, None]
    return (found * np.sign(np.take_along_axis(found, largest, axis=1))).astype(np.float32)
