"""Nothing that lies in the cache is believed that is not what was written there, by this user."""

import logging
import os
import random
import subprocess
import sys
import time

import numpy as np
import pytest

from discmech import BadInput, Scheme
from discmech.integrators import files, places, scenes
from discmech.integrators.compiler import cache, kernels, machine_code
from tests.foreign_files import check_untouched, foreign_files
from tests.objects.rules import trapezoidal

FLIPS = int(os.environ.get("DISCMECH_FLIPS", "12"))  # by hand: 2000
posix = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="its rights are no bits")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache of its own that no process-wide memory stands in front of."""
    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path))
    monkeypatch.delenv(places._TEMPORARY, raising=False)
    places._temporary_folder.cache_clear()
    forget()
    yield tmp_path / "discmech-cache"
    places._temporary_folder.cache_clear()
    forget()


def forget():
    for thing in (kernels.compile, kernels.compiled_text, kernels.kernel_text, files.prune,
                  places.say_once):  # fmt: skip
        thing.cache_clear()


def run():
    """A motion by machine code, and by Python's kernels, from what the cache holds."""
    scheme = Scheme(scenes.get("harmonic"), trapezoidal)
    return [scheme.flow("1/10", digits).trajectory(8).x for digits in (16, 30)]


def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


@pytest.mark.slow
def test_a_flipped_bit_is_rebuilt_and_said(folder, caplog):
    wanted, chance = run(), random.Random(1)
    kept = {p: p.read_bytes() for p in folder.iterdir() if p.suffix in (".o", ".py")}
    assert {p.suffix for p in kept} == {".o", ".py"}
    for _ in range(FLIPS):
        path, content = chance.choice(sorted(kept.items()))
        damaged, place = bytearray(content), chance.randrange(len(content))
        damaged[place] ^= 1 << chance.randrange(8)
        path.write_bytes(damaged)
        caplog.clear()
        forget()
        assert same(run(), wanted) and "was damaged" in caplog.text
        assert path.read_bytes() == content


@pytest.mark.parametrize("damage", [b"", b"half", b"\0" * 100, None])
def test_any_other_content_is_rebuilt(folder, damage):
    wanted = run()
    first, second, *_ = sorted(p for p in folder.iterdir() if p.suffix == ".py" or p.suffix == ".o")
    first.write_bytes(second.read_bytes() if damage is None else damage)  # another file's, sealed
    forget()
    assert same(run(), wanted)


@posix
@pytest.mark.parametrize("mode", [0o770, 0o707, 0o777])
def test_a_folder_that_others_can_write_to_is_refused(folder, mode):
    folder.mkdir()
    folder.chmod(mode)
    with pytest.raises(BadInput, match=r"others can write into it.*chmod go-w"):
        places.cache_folder()
    with pytest.raises(BadInput, match="is not used"):
        run()


@posix
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="gives a folder away")
def test_another_users_folder_is_refused(folder):
    folder.mkdir()
    os.chown(folder, 12345, -1)
    with pytest.raises(BadInput, match=r"belongs to another user \(12345\)"):
        places.cache_folder()


@posix
@pytest.mark.parametrize("change", [
    lambda path: path.chmod(0o666), lambda path: path.chmod(0o660),
    pytest.param(lambda path: os.chown(path, 12345, -1), marks=pytest.mark.skipif(
        not hasattr(os, "geteuid") or os.geteuid() != 0, reason="gives a file away")),
])  # fmt: skip
def test_a_file_that_another_user_wrote_or_can_write_is_made_anew(folder, change, caplog):
    cache.keep("a.py", b"text")
    change(folder / "a.py")
    assert cache.find("a.py") is None and "is not yours alone" in caplog.text
    assert cache.cached("a.py", lambda: b"text") == b"text" == cache.find("a.py")


def test_a_cache_that_can_only_be_read_is_read(folder, caplog, monkeypatch):
    wanted = run()
    before = sorted(p.name for p in folder.iterdir())
    forget()
    allowed = os.access
    monkeypatch.setattr(os, "access", lambda path, how: (
        not (how & os.W_OK and str(path) == str(folder)) and allowed(path, how)))  # fmt: skip
    assert places.is_temporary() and places.cache_folders() == (places.cache_folder(), folder)
    monkeypatch.setattr(machine_code, "_object", None)  # nothing is compiled again
    assert same(run(), wanted) and sorted(p.name for p in folder.iterdir()) == before
    assert caplog.text.count("cannot be written to") == 1


def test_without_a_home_all_is_temporary(monkeypatch, caplog, folder):
    monkeypatch.delenv("DISCMECH_CACHE")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(places.Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    assert places.is_temporary() and "there is no home folder" in caplog.text


@pytest.mark.parametrize("number", [5, 28, 116])
def test_a_disk_that_takes_nothing_costs_nothing_else(folder, monkeypatch, caplog, number):
    def refuse(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(cache, "write_atomically", refuse)
    assert len(run()) == 2 and os.strerror(number) in caplog.text


def test_what_nobody_asked_for_in_90_days_goes(folder):
    run()
    old, used, young = folder / "old.py", folder / "used.py", folder / "young.py"
    for path, days in {old: 91, used: 91, young: 89}.items():
        cache.seal(path, b"text")
        os.utime(path, (time.time() - days * files.DAY,) * 2)
    assert cache.find("used.py") == b"text"  # which is asking for it
    (folder / "pruned").unlink()
    forget()
    cache.keep("new.py", b"text")
    assert [path.exists() for path in (old, used, young)] == [False, True, True]


def forgotten(folder):
    """The cache, as a day later, when it is cleaned again."""
    forget()
    (folder / "pruned").unlink(missing_ok=True)
    cache.keep("new.py", b"text")


@pytest.mark.parametrize("days", [0, 1000])
def test_what_is_not_ours_stays_in_the_cache_itself(folder, tmp_path, days):
    """Also where a name is one of ours, and behind links."""
    forgotten(folder)
    before = foreign_files(folder / "mine", days)
    for path in [p for p in (folder / "mine").iterdir() if p.name != places.TAG]:
        path.rename(folder / path.name)
    sealed, renamed = folder / "a.py", folder / "renamed.py"
    cache.seal(sealed, b"text")
    sealed.rename(renamed)  # so it is not what we wrote under this name
    cache.seal(tmp_path / "linked.py", b"text")
    (folder / "linked.py").symlink_to(tmp_path / "linked.py")
    os.utime(tmp_path / "linked.py", (0, 0))
    os.utime(renamed, (0, 0))
    for _ in range(2):
        forgotten(folder)
        run()
    assert renamed.exists() and (folder / "linked.py").is_symlink()
    del before[places.TAG], before["pruned"]
    check_untouched(folder, before)


@pytest.mark.parametrize("days", [0, 1000])
@pytest.mark.parametrize("place", [".", "discmech-cache"])
def test_a_folder_of_somebody_else_stays_as_it_is(folder, tmp_path, place, days):
    """The cache lies in one of its own there, and is none where that is somebody else's."""
    before = foreign_files(tmp_path / place, days)
    if place == ".":
        run()
        assert (folder / places.TAG).read_bytes().startswith(b"Signature: 8a477f597d28d172789f0688")
    else:
        with pytest.raises(BadInput, match=r"has files and not our mark \(CACHEDIR.TAG\)"):
            run()
    check_untouched(tmp_path / place, before)


@pytest.mark.slow
def test_many_processes_make_the_mark_at_once(folder):
    """Nobody takes the cache of another one for a stranger's."""
    keep = "import sys; from discmech.integrators.compiler.cache import keep; sys.stdin.read();" \
           "keep(sys.argv[1], b'text')"  # fmt: skip
    begun = [subprocess.Popen([sys.executable, "-c", keep, f"{k}.py"], stdin=subprocess.PIPE)
             for k in range(6)]  # fmt: skip
    for process in begun:
        process.stdin.close()
    assert [process.wait() for process in begun] == 6 * [0]
    assert {f"{k}.py" for k in range(6)} < {path.name for path in folder.iterdir()}


def test_a_long_name_is_no_longer_file(folder):
    scene = scenes.get("harmonic").with_values(name="x" * 260)
    assert len(Scheme(scene, trapezoidal).flow("1/10").trajectory(2).x) == 3


def test_what_is_told_is_told_in_a_sentence(caplog):
    places.say_once.cache_clear()
    with caplog.at_level(logging.WARNING):
        places.say_once("this is said.")
        places.say_once("this is said.")
    assert caplog.messages == ["discmech: this is said."]
