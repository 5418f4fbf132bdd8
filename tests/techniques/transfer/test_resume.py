"""Bakes of transfer that were interrupted, and go on to the very bytes of an uninterrupted one."""

import numpy as np
import pytest
import transfer_scenes
from probe_bakes import Memory, bytes_of

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.probes import gather

FEW = {"rays": 256, "sun_side": 9, "sites": 2, "cache_rays": 32}


def bake(checkpoint=None, threads=1, said=None):
    technique = techniques.get("transfer")
    progress = Progress() if said is None else Progress(said)
    return technique.bake(transfer_scenes.room(), technique.Settings(**FEW), np.random.default_rng(2), progress,
                          threads=threads, checkpoint=checkpoint)


@pytest.fixture(scope="module")
def whole():
    return bytes_of(bake())


def test_parts_are_saved_of_all_that_takes_long(whole, monkeypatch):
    monkeypatch.setattr("rtgi_addon.techniques.transfer.bake.ITEM_RAYS", 256 * gather.GROUP)
    memory = Memory()
    assert bytes_of(bake(memory)) == whole
    names = set(memory.stored)
    assert "sources" in names and "probes0" in names and len([name for name in names if name.startswith("columns")]) >= 1


@pytest.mark.parametrize("stop", [1, 2, 3])
def test_it_goes_on_to_the_same_bytes(whole, stop):
    memory = Memory(stop=stop)
    with pytest.raises(KeyboardInterrupt):
        bake(memory)
    again = Memory(memory.stored)
    assert bytes_of(bake(again, threads=2)) == whole
    # What was there is not made again.
    assert not set(memory.stored) & {name for name in again.stored if again.stored[name] is not memory.stored.get(name)}
