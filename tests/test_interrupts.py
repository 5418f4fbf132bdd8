"""Wishes to end: the first is heeded in order, the second at once."""

import os
import signal
import threading

import pytest

from rtgi_addon.interrupts import Interrupts

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no signals to send to oneself")
ALL = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.fixture(autouse=True)
def heard():
    """Nothing is ignored, as it is for what a shell runs in its background."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in ALL}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", ALL)
def test_one_stops_in_order_and_two_at_once(number):
    before, stopped = [signal.getsignal(each) for each in ALL], []
    with Interrupts() as interrupts:
        interrupts.on_stop(lambda: stopped.append(True))
        os.kill(os.getpid(), number)
        assert stopped == [True] and interrupts.arrived
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGTERM)
    assert [signal.getsignal(each) for each in ALL] == before


def test_one_that_came_early_is_heeded_late():
    stopped = []
    with Interrupts() as interrupts:
        os.kill(os.getpid(), signal.SIGHUP)
        interrupts.on_stop(lambda: stopped.append(True))
    assert stopped == [True]


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interrupts() as interrupts:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not interrupts.arrived
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_outside_the_main_thread_nothing_is_taken():
    before = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=Interrupts)
    thread.start()
    thread.join()
    assert signal.getsignal(signal.SIGINT) is before
