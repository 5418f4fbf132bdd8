"""The one folder beside a result: who may work there, what of it is ours, and that no kill costs the old or the new."""

import json
import os
import threading

import pytest
from kills import needs_fork, run_killed

from rtgi_addon.errors import BakeError
from rtgi_addon.storage.reading import sha256_of_file
from rtgi_addon.storage.workplace import LOCK, MARK, partial_of, workplace
from rtgi_addon.storage.writing import write_file, write_text


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """A kill loses nothing that the system holds, so the many tries here do not wait for the disk."""
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def digests(folder):
    return {name: sha256_of_file(folder / name) for name in contents(folder)}


def put_folder(out, files):
    """Replace folder ``out``, of which all is ours, by ``files``."""
    with workplace(out, "test") as place:
        for name, text in files.items():
            write_text(place.new / name, text)
        return place.put_folder(digests(out) if out.exists() else {})


def put_files(out, files, ours):
    """Put ``files`` into ``out``; ``ours`` (name → checksum) are replaced, or removed where they are no longer among the files."""
    with workplace(out, "test") as place:
        for name, text in files.items():
            write_text(place.new / name, text)
        replaced = {name: digest for name, digest in ours.items() if name in files}
        place.put_files(replaced, {name: digest for name, digest in ours.items() if name not in files})


def put_file(out, text):
    write_text(out, text)


OLD, NEW = {"a": "old a", "deep/b": "old b", "gone/c": "c"}, {"a": "new a", "deep/b": "new b", "deep/er/d": "new d"}


def as_bytes(files):
    return {name: text.encode() for name, text in files.items()}


def test_nothing_is_left_beside_a_result(tmp_path):
    put_folder(tmp_path / "out", OLD)
    assert contents(tmp_path) == as_bytes({f"out/{name}": text for name, text in OLD.items()})
    put_folder(tmp_path / "out", NEW)
    assert contents(tmp_path) == as_bytes({f"out/{name}": text for name, text in NEW.items()})
    put_file(tmp_path / "x.png", "one")
    put_file(tmp_path / "x.png", "two")
    assert (tmp_path / "x.png").read_text() == "two" and sorted(os.listdir(tmp_path)) == ["out", "x.png"]


def test_an_error_leaves_the_old_and_nothing_else(tmp_path):
    put_folder(tmp_path / "out", OLD)
    with pytest.raises(ZeroDivisionError), workplace(tmp_path / "out", "test") as place:
        write_text(place.new / "deep/x", "half")
        raise ZeroDivisionError
    assert contents(tmp_path / "out") == as_bytes(OLD) and os.listdir(tmp_path) == ["out"]


def test_a_set_of_files_leaves_the_others_alone(tmp_path):
    out = tmp_path / "out"
    put_folder(out, OLD)
    ours = digests(out)
    (out / "gone" / "mine").write_text("mine")
    (out / "mine").write_text("mine")
    put_files(out, NEW, ours)
    assert contents(out) == as_bytes({**NEW, "gone/mine": "mine", "mine": "mine"})
    (out / "gone" / "mine").unlink()
    put_files(out, OLD, digests(out) | {"mine": "0"})
    assert contents(out) == as_bytes({**OLD, "mine": "mine"})
    put_files(out, {"a": "a"}, {name: digest for name, digest in digests(out).items() if name != "mine"})
    assert sorted(os.listdir(out)) == ["a", "mine"], "folders that held only ours go with it"


def test_who_holds_it_is_named(tmp_path):
    with workplace(tmp_path / "out", "bake"):
        with pytest.raises(BakeError, match=rf"process {os.getpid()} on .* is writing .*out \(bake, since 20"):
            with workplace(tmp_path / "out", "bake"):
                pass
        with workplace(tmp_path / "other", "bake"):
            pass
    with workplace(tmp_path / "out", "bake"):
        pass


def test_of_many_at_once_one_works_at_a_time(tmp_path):
    inside, most, refused, done = [], [], [], []

    def work(number):
        for _ in range(20):
            try:
                with workplace(tmp_path / "out", "test") as place:
                    inside.append(number)
                    most.append(len(inside))
                    write_text(place.new / "out", str(number))
                    place.put_file()
                    inside.remove(number)
                    done.append(number)
            except BakeError as error:
                refused.append(str(error))

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert max(most) == 1 and done and all("is writing" in words for words in refused), set(refused)
    assert os.listdir(tmp_path) == ["out"]


def elsewhere(folder, **other):
    """Make the lock in ``folder`` that of another holder."""
    text = json.loads((folder / LOCK).read_text())
    text["holder"] = {**text["holder"], **other}
    return json.dumps(text)


@pytest.mark.parametrize(("other", "taken"), [
    ({"process": 1 << 22}, True),
    ({"boot": "another start of this machine", "process": 1}, True),
    ({"host": "a container", "process": 1}, True),
    ({"host": "render7", "machine": "another", "boot": "another"}, False),
])
def test_a_lock_of_somebody_who_is_gone_is_taken_over(tmp_path, other, taken):
    with workplace(tmp_path / "out", "bake") as place:
        text = elsewhere(place.folder, **other)
    folder = partial_of(tmp_path / "out")
    folder.mkdir()
    (folder / LOCK).write_text(text)
    if not os.path.exists("/proc/sys/kernel/random/boot_id") and "host" in other and taken:
        pytest.skip("containers are told apart on Linux only")
    if taken:
        put_folder(tmp_path / "out", NEW)
        assert os.listdir(tmp_path) == ["out"]
        return
    with pytest.raises(BakeError, match=r"on render7 is writing") as caught:
        put_folder(tmp_path / "out", NEW)
    assert f"remove {folder / LOCK} if it no longer runs" in caught.value.remedy
    (folder / LOCK).unlink()
    put_folder(tmp_path / "out", NEW)


def test_without_locks_of_the_system_the_process_is_looked_for(tmp_path, monkeypatch):
    from rtgi_addon.storage import lock
    monkeypatch.setattr(lock, "_try_lock", lambda descriptor: None)
    with workplace(tmp_path / "out", "bake"), pytest.raises(BakeError, match="is writing"), workplace(tmp_path / "out", "bake"):
        pass
    with workplace(tmp_path / "out", "bake") as place:
        reused, gone = elsewhere(place.folder, started="1"), elsewhere(place.folder, process=1 << 22)
    for text in (reused, gone):
        partial_of(tmp_path / "out").mkdir()
        (partial_of(tmp_path / "out") / LOCK).write_text(text)
        put_folder(tmp_path / "out", NEW)


def test_a_lock_that_was_taken_away_stops_the_exchange(tmp_path):
    put_folder(tmp_path / "out", OLD)
    with pytest.raises(BakeError, match="somebody removed"), workplace(tmp_path / "out", "test") as place:
        write_text(place.new / "a", "new")
        (place.folder / LOCK).unlink()
        place.put_folder(digests(tmp_path / "out"))
    assert contents(tmp_path / "out") == as_bytes(OLD)


@pytest.mark.parametrize("make", [
    lambda folder: (folder / "thesis.txt").write_text("mine"),
    lambda folder: (folder / "new").mkdir(),
    lambda folder: (folder / LOCK).write_text("my own lock"),
    lambda folder: (folder / MARK).write_text("{}"),
])
def test_a_folder_of_that_name_which_is_not_ours_is_left_alone(tmp_path, make):
    folder = partial_of(tmp_path / "out")
    folder.mkdir()
    make(folder)
    before = sorted(folder.rglob("*")), contents(folder)
    with pytest.raises(BakeError, match="in the way, rtgi did not"):
        put_folder(tmp_path / "out", NEW)
    assert (sorted(folder.rglob("*")), contents(folder)) == before


def test_a_link_or_file_of_that_name_is_left_alone(tmp_path):
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "x").write_text("mine")
    partial_of(tmp_path / "out").symlink_to(tmp_path / "theirs")
    partial_of(tmp_path / "two").write_text("mine")
    for name in ("out", "two"):
        with pytest.raises(BakeError, match="in the way"):
            put_folder(tmp_path / name, NEW)
    assert (tmp_path / "theirs" / "x").exists() and partial_of(tmp_path / "two").read_text() == "mine"


def killed(tmp_path, function, at):
    return run_killed(function, at, tmp_path)[0] is None


@needs_fork
@pytest.mark.parametrize("place", ["", "new/", "old/", "new/deep/"])
def test_a_users_file_in_what_a_killed_run_left_is_kept(tmp_path, place):
    out, at = tmp_path / "out", 0
    put_folder(out, OLD)
    while True:
        at += 1
        assert killed(tmp_path, lambda: put_folder(out, NEW), at), f"never saw {place}"
        if (partial_of(out) / place / ".").exists() and (partial_of(out) / MARK).exists():
            break
        put_folder(out, OLD)
    mine = partial_of(out) / place / "notes.txt"
    mine.write_text("mine")
    for _ in range(2):
        with pytest.raises(BakeError, match=r"holds .*notes\.txt, which rtgi did not write"):
            put_folder(out, NEW)
    assert mine.read_text() == "mine"
    mine.unlink()
    put_folder(out, NEW)
    assert contents(tmp_path) == as_bytes({f"out/{name}": text for name, text in NEW.items()})


@needs_fork
def test_a_kill_before_any_operation_leaves_the_old_folder_or_the_new(tmp_path):
    out, at, seen = tmp_path / "out", 0, set()
    while True:
        at += 1
        put_folder(out, OLD)
        if not killed(tmp_path, lambda: put_folder(out, NEW), at):
            break
        found = contents(out) if out.exists() else contents(partial_of(out) / "old")
        seen.add("old" if found == as_bytes(OLD) else "new" if found == as_bytes(NEW) else f"half at {at}")
        # What reads nothing and writes nothing still puts everything in order.
        with workplace(out, "test"):
            pass
        assert contents(out) in (as_bytes(OLD), as_bytes(NEW)), at
        assert os.listdir(tmp_path) == ["out"], at
    assert seen == {"old", "new"} and at > 25


@needs_fork
def test_a_kill_before_any_operation_leaves_the_old_file_or_the_new(tmp_path):
    out, at, seen = tmp_path / "x.png", 0, set()
    while True:
        at += 1
        put_file(out, "old")
        if not killed(tmp_path, lambda: put_file(out, "new"), at):
            break
        seen.add(out.read_text())
        put_file(out, "newer")
        assert out.read_text() == "newer" and os.listdir(tmp_path) == ["x.png"], at
    assert seen == {"old", "new"} and at > 10


@needs_fork
def test_a_kill_before_any_operation_leaves_a_set_of_files_that_the_next_run_completes(tmp_path):
    out, at, seen = tmp_path / "out", 0, set()
    while True:
        at += 1
        put_folder(out, OLD)
        ours = digests(out)
        (out / "mine").write_text("mine")
        ended = not killed(tmp_path, lambda ours=ours: put_files(out, NEW, ours), at)
        with workplace(out, "test"):
            pass
        found = contents(out)
        assert found.pop("mine") == b"mine" and found in (as_bytes(OLD), as_bytes(NEW)), at
        assert os.listdir(tmp_path) == ["out"], at
        if ended:
            break
        seen.add("old" if found == as_bytes(OLD) else "new")
        (out / "mine").unlink()
    assert seen == {"old", "new"} and at > 25


@needs_fork
def test_a_kill_of_the_repair_is_repaired(tmp_path):
    out = tmp_path / "out"
    for first in (17, 23, 29, 35):
        put_folder(out, OLD)
        if not killed(tmp_path, lambda: put_folder(out, NEW), first):
            break
        second = 0
        while True:
            second += 1
            if not killed(tmp_path, lambda: put_folder(out, NEW), second):
                break
        assert contents(out) == as_bytes(NEW) and os.listdir(tmp_path) == ["out"]


@needs_fork
def test_a_file_that_is_changed_after_a_kill_is_never_replaced(tmp_path):
    out, at = tmp_path / "out", 0
    put_folder(out, OLD)
    (out / "mine").write_text("mine")
    while not (partial_of(out) / "commit.json").exists():
        at += 1
        assert killed(tmp_path, lambda: put_files(out, NEW, digests(out)), at)
    (out / "deep/b").write_text("edited")
    with pytest.raises(BakeError, match=r"deep/b was changed while it was being replaced"), workplace(out, "test"):
        pass
    assert (out / "deep/b").read_text() == "edited" and (partial_of(out) / "new/deep/b").read_text() == "new b"


def test_what_is_put_into_a_folder_at_the_last_moment_is_kept_and_named(tmp_path):
    out = tmp_path / "out"
    put_folder(out, OLD)
    ours = digests(out)
    with workplace(out, "test") as place:
        write_text(place.new / "a", "new")
        (out / "mine").write_text("mine")
        stranger = place.put_folder(ours)
    assert stranger.name == "mine" and contents(out) == {"a": b"new"}
    assert (partial_of(out) / "old/mine").read_text() == "mine"


def test_what_is_not_listed_is_a_fault_of_ours(tmp_path):
    with pytest.raises(RuntimeError, match=r"loose was not written"), workplace(tmp_path / "out", "test") as place:
        (place.new / "loose").write_text("x")
        place.put_folder({})


def test_a_device_is_never_replaced(tmp_path):
    if not os.path.exists("/dev/full"):
        pytest.skip("this system has no /dev/full")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(BakeError, match="is not a file"):
        write_file(pipe, b"x")
    assert pipe.is_fifo() and os.listdir(tmp_path) == ["pipe"]


def test_a_link_to_a_file_is_followed_and_permissions_stay(tmp_path):
    (tmp_path / "real").mkdir()
    target = tmp_path / "real" / "x"
    target.write_text("old")
    target.chmod(0o640)
    (tmp_path / "link").symlink_to(target)
    write_file(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink() and target.read_text() == "new"
    assert os.name == "nt" or target.stat().st_mode & 0o777 == 0o640


def test_a_way_through_a_file_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match=r"not a directory|file exists"), workplace(tmp_path / "file/out", "test"):
        pass


def test_folders_on_the_way_are_made_and_go_again_if_nothing_comes_of_it(tmp_path):
    path = tmp_path / "a/b/out"
    with pytest.raises(RuntimeError, match="mid-way"), workplace(path, "test") as place:
        assert place.folder.is_dir()
        raise RuntimeError("mid-way")
    assert not list(tmp_path.iterdir())
    (tmp_path / "a").mkdir()
    with workplace(path, "test") as place:
        write_text(place.new / "x.txt", "kept")
        assert place.put_folder({}) is None
    assert (path / "x.txt").read_text() == "kept"
