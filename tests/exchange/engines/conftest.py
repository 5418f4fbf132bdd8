"""A bundle for exports: the conformance kit itself, whose probes are of every kind."""

from pathlib import Path

import pytest

from rtgi_addon.exchange.bundle import Bundle
from rtgi_addon.exchange.engines.kit import kit_field


@pytest.fixture(scope="session")
def kit_bundle():
    """The kit as a bundle that was read."""
    return Bundle(Path("kit"), {"includes_direct": False}, kit_field().grids())
