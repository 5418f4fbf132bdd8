"""Trials in one process: one that ends it or hangs is a finding, and none of the others is lost or counted twice."""

import os
import signal
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import company
import pytest
from common import Tally
from kills import needs_fork


class Troubled:
    """Trials of which some end their process."""

    def __init__(self, deadly, hanging):
        self._deadly, self._hanging = deadly, hanging

    def trial(self, number, tally):
        if number in self._deadly:
            os.kill(os.getpid(), signal.SIGKILL)
        while number in self._hanging:
            time.sleep(1.0)
        if number == 4:
            tally.findings.append((4, "wrong"))
        tally.count(f"number {number}")


@needs_fork
def test_the_others_go_on(monkeypatch):
    monkeypatch.setattr(company, "PATIENCE", 0.3)
    monkeypatch.setattr(company, "SAID", 0.05)
    tally = Tally()
    company.in_company(Troubled({3, 9}, {6}), range(10), tally)
    assert tally.counts == {"trials": 10} | {f"number {number}": 1 for number in (0, 1, 2, 4, 5, 7, 8)}
    assert sorted(number for number, _ in tally.findings) == [3, 4, 6, 9]
    found = dict(tally.findings)
    assert found[4] == "wrong" and "ended with -9" in found[3] and "for more than 0.3 s" in found[6]


@needs_fork
@pytest.mark.skipif(not os.path.exists("/proc/self/clear_refs"), reason="limits what Linux limits")
def test_too_much_is_refused_and_the_peak_is_known():
    with company.held(1 << 26) as costs, pytest.raises(MemoryError):
        bytearray(1 << 28)
    before = costs.peak_bytes
    with company.held(1 << 28) as costs:
        bytearray(b"1" * (1 << 26))
    assert before < costs.peak_bytes < before + (3 << 26)
