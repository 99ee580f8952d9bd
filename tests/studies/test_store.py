"""Results are measured once, kept, and found again; what is damaged is not believed."""

import errno
import os
import random
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from dataclasses import replace
from functools import partial
from json import dumps

import pytest

from discmech.integrators import BadInput, places, scenes
from discmech.integrators.rules import midpoint
from discmech.studies import get
from discmech.studies.command import INTERRUPTED
from discmech.studies.command.entry import main
from discmech.studies.core import fingerprint, one_case, side_by_side
from discmech.studies.core.case import Case, Choice, Verdict
from discmech.studies.core.outcome import Found, Measurement
from discmech.studies.core.store import Store
from discmech.studies.core.study import Study
from discmech.studies.momentum.limits import LIMITS
from tests.foreign_files import check_untouched, foreign_files
from tests.kill_points import json_of
from tests.studies.as_json import read, run_study

CHOICE = Choice(scenes=tuple(map(scenes.get, ("kepler", "rigid-body", "heavy-top"))),
                rules=(midpoint,), digits=(16,), steps=10)  # fmt: skip
FLIPS = int(os.environ.get("DISCMECH_FLIPS", "8"))  # by hand: 2000
ALL = ["kepler", "rigid-body", "heavy-top"]


@pytest.fixture
def study(monkeypatch):
    """The momentum study with a measurement that keeps a list, and can be interrupted."""
    module = get("momentum").measuring
    state = {"measured": [], "stop_at": None}

    def measure(case, progress):
        if case.scene.name == state["stop_at"]:
            raise KeyboardInterrupt
        state["measured"].append(case.scene.name)
        drift = len(state["measured"]) / 10**17  # far below a rounding
        return {"measured": {"drift": {"J": drift}}, "rows": [{"step": 1, "drift": {"J": drift}}],
                "steps": 10}  # fmt: skip

    monkeypatch.setattr(module, "measure", measure)

    def run(stop_at=None, choice=CHOICE, fresh=False):
        """The scenes measured by this run, and its result (None if it was interrupted)."""
        state.update(measured=[], stop_at=stop_at)
        try:
            found = run_study(get("momentum"), choice, store=Store(fresh))
        except KeyboardInterrupt:
            found = None
        return state["measured"], found

    return run


def test_an_interrupted_run_goes_on_where_it_stopped(study):
    assert study("rigid-body") == (["kepler"], None)
    assert study("heavy-top") == (["rigid-body"], None)
    measured, found = study()
    assert measured == ["heavy-top"]
    assert [c["scene"] for c in found["cases"]] == ALL and found["verdict"] == "pass"
    assert any("2 of 3 cases were measured by an earlier run" in note for note in found["notes"])


def test_what_is_found_is_what_was_measured_to_the_last_bit(study):
    _, first = study()
    measured, again = study()
    assert measured == [] and again["cases"] == first["cases"]
    assert {"date", "commit", "clean"} == set(again["cases"][0]["measured_at"])


def test_fresh_measures_all_anew_and_keeps_it(study):
    _, first = study()
    measured, again = study(fresh=True)
    assert measured == ALL and not any("earlier run" in note for note in again["notes"])
    assert study()[1]["cases"] == again["cases"]


def test_without_a_store_nothing_is_kept(study, tmp_path):
    run_study(get("momentum"), CHOICE)
    assert not (tmp_path / "cache" / "discmech-cache" / "results").exists()


def test_a_changed_judge_measures_nothing_anew(study, monkeypatch):
    _, first = study()
    assert first["verdict"] == "pass"
    told = get("momentum").judging
    monkeypatch.setattr(
        told, "judge", lambda *_: Verdict("inconclusive", "so it is.", {"limit": 0})
    )
    measured, again = study()
    assert measured == [] and again["verdict"] == "inconclusive"
    assert again["cases"][0]["measured"] == first["cases"][0]["measured"]


@pytest.mark.parametrize(("name", "value", "verdict"), [
    ("walk", -10, "fail"), ("blind", -1, "inconclusive"),
])  # fmt: skip
def test_a_changed_limit_measures_nothing_anew(study, monkeypatch, name, value, verdict):
    assert study()[1]["verdict"] == "pass"
    monkeypatch.setitem(LIMITS, name, value)
    measured, again = study()
    assert measured == [] and again["verdict"] == verdict


@pytest.mark.parametrize("column", ["content", "seal"])
def test_a_damaged_row_is_measured_again(study, rows, column):
    study()
    rows(f"UPDATE entry SET {column} = replace({column}, substr({column}, 30, 9), 'x')")
    measured, found = study()
    assert measured == ALL and any("damaged" in note for note in found["notes"])
    assert study()[0] == []


def test_a_row_in_the_place_of_another_is_not_believed(study, rows):
    study()
    (first,), (second,), *_ = rows()
    rows("UPDATE entry SET (seal, content) = (SELECT seal, content FROM entry WHERE name = ?) "
         "WHERE name = ?", first, second)  # fmt: skip
    assert len(study()[0]) == 1


@pytest.mark.parametrize("damage", [
    lambda old: b"no database at all, but a text", lambda old: old[: len(old) // 2],
    lambda old: bytes(len(old)), lambda old: old[:100] + bytes(300) + old[400:],
])  # fmt: skip
def test_a_damaged_file_is_kept_aside_and_all_is_measured_again(study, tmp_path, damage):
    study()
    file = tmp_path / "cache" / "discmech-cache" / "results" / "store.sqlite"
    bad = damage(file.read_bytes())
    file.write_bytes(bad)
    measured, found = study()
    assert set(measured) <= set(ALL) and measured
    assert any("damaged" in note for note in found["notes"])
    assert study()[0] == [] and found["verdict"] == "pass"
    assert (file.parent / "store-damaged-1.sqlite").read_bytes()[:400] == bad[:400]


def test_what_is_whole_in_a_damaged_file_is_kept_and_counted():
    """A run of the history cannot be made again."""
    store = Store()
    for k in range(200):
        store.keep("run", f"{k:03}", {"k": k, "more": "x" * 500})
    store.close()
    data = bytearray(store.path.read_bytes())
    middle = len(data) // 2 // 4096 * 4096
    data[middle : middle + 4096] = bytes(4096)
    store.path.write_bytes(data)
    again = Store()
    found = {name: run for name, run, _ in again.all("run") if run is not None}
    assert len(found) > 150 and all(run["k"] == int(name) for name, run in found.items())
    assert f"; {len(found)} of its results are whole, and kept." in again.troubles["aside"]


def test_a_file_of_which_nothing_is_kept_says_so(monkeypatch):
    def told():
        Store().save("run", "1", {})
        store = Store()
        store.path.write_bytes(b"no database" * 999)
        assert not list(store.all("run"))
        return store.troubles["aside"]

    assert told().endswith("; none of its results are whole.")
    monkeypatch.setattr("discmech.studies.core.store.rows_in", _full)
    assert told().endswith("; its results cannot be kept (No space left on device).")


def _full(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_store_of_another_version_is_kept_aside(study, rows, tmp_path):
    study()
    rows("PRAGMA user_version = 99")
    measured, found = study()
    aside = tmp_path / "cache" / "discmech-cache" / "results" / "store-version-99-1.sqlite"
    assert measured == ALL and aside.exists()
    assert any("of another version" in note and str(aside) in note for note in found["notes"])
    assert study()[0] == []


def test_each_version_of_the_store_keeps_its_own_file(monkeypatch):
    """Two checkouts may share a cache: neither puts the other's results aside."""
    stores = []
    for version in (1, 2, 1, 2):
        monkeypatch.setattr("discmech.studies.core.store.VERSION", version)
        stores.append(Store())
        kept = stores[-1].find("measurement", "mine")
        assert kept == (version if len(stores) > 2 else None)
        stores[-1].keep("measurement", "mine", version)
    assert not any(store.troubles for store in stores)


@pytest.mark.parametrize("days", [0, 1000])
def test_files_of_others_stay_beside_the_store(study, tmp_path, days):
    cache = tmp_path / "cache" / "discmech-cache"
    before = foreign_files(cache, days)
    for path in (cache / "results").glob("store.sqlite*"):  # where ours will be
        before.pop(f"results/{path.name}")
        path.unlink()
    study()
    (cache / "results" / "store.sqlite").write_bytes(b"no database" * 999)
    study()
    check_untouched(cache, before)


def test_after_any_flipped_bit_the_store_is_read_and_written():
    """In the head, the table's text and the rows: what is damaged is put aside."""
    store = Store()
    for k in range(4):
        store.keep("run", str(k), {"k": k})
    store.close()
    good, drawn = store.path.read_bytes(), random.Random(FLIPS)
    page = 4096
    places_of = [range(100), range(page - 400, page), range(page, len(good))]
    harmed = [(18, 0), (47, 0), (page - 116, 0)]  # read-only, of no known form, of another table
    harmed += [(drawn.choice(part), drawn.randrange(8)) for part in places_of for _ in range(FLIPS)]
    for place, bit in harmed:
        for path in store.path.parent.iterdir():
            path.unlink()
        damaged = bytearray(good)
        damaged[place] ^= 1 << bit
        store.path.touch(0o600)
        store.path.write_bytes(damaged)
        Store().keep("run", "9", {"k": 9})
        again = Store()
        found = {name: run for name, run, _ in again.all("run") if run is not None}
        assert found["9"] == {"k": 9} and not again.troubles, (place, bit)
        assert all(run == {"k": int(name)} for name, run in found.items()), (place, bit)


posix = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="rights are no bits")


@posix
@pytest.mark.parametrize("end", ["", "-wal", "-shm", "-journal"])
def test_a_file_that_others_can_write_to_is_not_believed(study, tmp_path, end):
    study()
    file = tmp_path / "cache" / "discmech-cache" / "results" / f"store.sqlite{end}"
    file.touch()
    file.chmod(0o666)
    measured, found = study()
    assert measured == ALL and any("not yours alone" in note for note in found["notes"])
    assert study()[0] == []


@posix
def test_a_folder_that_others_can_write_to_is_refused(study, tmp_path):
    study()
    (tmp_path / "cache" / "discmech-cache" / "results").chmod(0o777)
    with pytest.raises(BadInput, match="results is not used, because others can write into it"):
        study()


@posix
def test_a_journal_that_another_user_forged_changes_no_result(study, tmp_path, monkeypatch):
    """Sqlite believes what lies beside a file; its seal holds, since anybody can compute it."""
    study()
    results = tmp_path / "cache" / "discmech-cache" / "results"
    honest = (results / "store.sqlite").read_bytes()
    forger = Store()
    with closing(sqlite3.connect(forger.path)) as file:
        ((name, content),) = file.execute("SELECT name, content FROM entry LIMIT 1").fetchall()
    forger.keep("measurement", name, "forged")
    journal = (results / "store.sqlite-wal").read_bytes()
    forger.close()
    for path in results.iterdir():
        path.unlink()
    (results / "store.sqlite").write_bytes(honest)
    (results / "store.sqlite").chmod(0o600)
    (results / "store.sqlite-wal").write_bytes(journal)
    assert Store().find("measurement", name) == "forged"  # as long as it counts as ours
    (results / "store.sqlite").write_bytes(honest)
    (results / "store.sqlite-wal").write_bytes(journal)
    true = places.whose
    inode = (results / "store.sqlite-wal").stat().st_ino
    monkeypatch.setattr(places, "whose", lambda found: (
        "it belongs to another user" if found.st_ino == inode else true(found)))  # fmt: skip
    store = Store()
    assert store.find("measurement", name) is None and "not yours alone" in store.troubles["aside"]


HOLDER = """
import sqlite3, sys
file = sqlite3.connect(sys.argv[1])
file.execute("BEGIN EXCLUSIVE")
print("held", flush=True)
sys.stdin.read()
"""


def test_a_lock_that_somebody_holds_is_waited_for_once(monkeypatch):
    """And again when it was free meanwhile."""

    def patience(store):
        return store._opened(store.path).execute("PRAGMA busy_timeout").fetchone()[0]

    monkeypatch.setattr("discmech.studies.core.store.PATIENCE", 0.5)
    store = Store()
    store.keep("measurement", "1", 1)
    assert patience(store) == 500
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(store.path)], text=True,
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:  # fmt: skip
        assert holder.stdout.readline() == "held\n"
        store.keep("measurement", "2", 2)
        assert "another program holds its lock" in store.troubles["keep"]
        assert patience(store) == patience(Store()) == 0
        holder.stdin.close()
    store.keep("measurement", "2", 2)
    assert patience(store) == 500 and Store().find("measurement", "2") == 2


def test_a_full_disk_says_so_and_loses_nothing(study, rows, monkeypatch):
    study(choice=replace(CHOICE, scenes=CHOICE.scenes[:1]))
    opened = Store._opened

    def full(self, path):
        file = opened(self, path)
        (pages,) = file.execute("PRAGMA page_count").fetchone()
        file.execute(f"PRAGMA max_page_count = {pages}")
        return file

    monkeypatch.setattr(Store, "_opened", full)
    monkeypatch.setattr("json.dumps", lambda content: dumps(content) + " " * 10_000)
    measured, found = study()
    assert measured == ALL[1:] and len(found["cases"]) == 3
    assert any("database or disk is full" in note for note in found["notes"])
    monkeypatch.undo()
    assert len(rows()) == 1


def test_a_disk_that_is_full_from_the_start_damages_nothing(study, tmp_path, monkeypatch):
    connect = sqlite3.connect

    def full(*given, **more):
        file = connect(*given, **more)
        file.execute("PRAGMA max_page_count = 1")  # the table needs two
        return file

    monkeypatch.setattr(sqlite3, "connect", full)
    notes = study()[1]["notes"]
    assert any("database or disk is full" in note for note in notes)
    assert not any("damaged" in note or "cannot be read" in note for note in notes)
    monkeypatch.undo()
    assert [
        p.name for p in (tmp_path / "cache" / "discmech-cache" / "results").glob("*.sqlite")
    ] == ["store.sqlite"]


def test_a_folder_that_may_only_be_read_is_read(study, tmp_path, monkeypatch):
    study()
    there = tmp_path / "cache" / "discmech-cache"
    monkeypatch.setattr("discmech.studies.core.store.cache_folder", lambda: tmp_path / "temporary")
    monkeypatch.setattr("discmech.studies.core.store.cache_folders",
                        lambda: (tmp_path / "temporary", there))  # fmt: skip
    before = (there / "results" / "store.sqlite").read_bytes()
    assert study()[0] == []
    assert (there / "results" / "store.sqlite").read_bytes() == before


def test_the_longest_unused_rows_go_first(study, rows, monkeypatch):
    study()
    Store().save("run", "1", {})
    for age, (name,) in enumerate(rows()):
        rows("UPDATE entry SET used = ? WHERE name = ?", 1e9 - age, name)
    newest = rows()[0]
    monkeypatch.setattr("discmech.studies.core.store.MOST", 2)
    Store().prune()
    assert rows() == [newest] and rows("SELECT count(*) FROM entry") == [(2,)]


@pytest.mark.slow
def test_two_stores_of_a_process_see_what_another_process_keeps(tmp_path):
    """A file that the process closed by itself would take the locks of the first store away."""
    folder = {"DISCMECH_CACHE": str(tmp_path / "cache")}
    keep = "from discmech.studies.core.store import Store; Store().save('measurement', '{0}', {0})"

    def other(number):
        words = [sys.executable, "-c", keep.format(number)]
        subprocess.run(words, check=True, env=os.environ | folder)

    other(0)
    stores = []
    for number in range(1, 4):
        stores.append(Store())
        assert stores[-1].find("measurement", "0") == 0
        other(number)
        assert [s.find("measurement", str(number)) for s in stores] == [number] * number


WRITER = """
import sys
from discmech.studies.core.store import Store
store = Store()
for k in range(10**6):
    store.save("measurement", str(k), {"k": k, "more": "x" * 3000})
    print(k, flush=True)
"""


@pytest.mark.slow
def test_a_process_that_is_killed_loses_nothing_that_it_kept(tmp_path):
    """Wherever in a write it is: sqlite writes by machine code, which has no points to stop at."""
    drawn, kept = random.Random(5), 0
    for _ in range(4):
        with subprocess.Popen(
            [sys.executable, "-c", WRITER], stdout=subprocess.PIPE, text=True,
            env=os.environ | {"DISCMECH_CACHE": str(tmp_path / "cache")},
        ) as process:  # fmt: skip
            said = [process.stdout.readline() for _ in range(3)]
            time.sleep(drawn.uniform(0, 0.05))
            process.kill()
            said += process.stdout.readlines()
        store = Store()
        last = int([line for line in said if line.endswith("\n")][-1])
        assert all(store.find("measurement", str(k))["k"] == k for k in range(last + 1))
        kept += last
    assert kept >= 8 and not Store().troubles


@pytest.mark.slow
def test_from_the_command_line(study, capsys, monkeypatch):
    words = ["momentum", "kepler", "heavy-top", "--rule", "midpoint", "--digits", "16"]
    module = get("momentum").measuring
    good, asked = module.measure, []

    def measure(case, progress):
        asked.append(case.scene.name)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return good(case, progress)

    monkeypatch.setattr(module, "measure", measure)
    assert main(words) == INTERRUPTED == 130
    assert "; the same command goes on where it stopped" in capsys.readouterr().err
    asked.pop()
    assert main([*words, "--fresh"]) == INTERRUPTED  # which would measure all anew
    assert "; without --fresh the same command goes on" in capsys.readouterr().err
    asked[1:] = ["heavy-top"]
    assert main(words) == 0 and asked == ["kepler", "heavy-top", "heavy-top"]
    assert main([*words, "--fresh"]) == 0 and len(asked) == 5


def test_a_cause_that_was_told_holds_while_all_text_is_the_same(monkeypatch):
    """It is told with rules and scenes beside the case's own."""
    asked, store, study = [], Store(), get("order")
    case = Case("order", scenes.get("kepler"), midpoint, 16)
    monkeypatch.setattr(study.judging, "judge", lambda *_: Verdict("fail", "so it is."))
    told = {"cause": "factor", "sentence": "it is wrong."}
    monkeypatch.setattr(study.judging, "diagnose", lambda *_: asked.append(1) or told)
    key = side_by_side.key_of(study, case)
    store.keep("measurement", key, Found(Measurement()).to_json())
    assert side_by_side.found_by(store, study, case, key, only=True) is None
    for _ in range(2):
        found = side_by_side.found_by(store, study, case, key)
        assert found.diagnosis == told and found.reason.endswith("factor: it is wrong.")
    assert side_by_side.found_by(store, study, case, key, only=True) == found and len(asked) == 1
    monkeypatch.setattr(fingerprint, "_text_of_search", lambda _: "changed")
    assert side_by_side.found_by(store, study, case, key) == found and len(asked) == 2


@pytest.mark.slow
def test_figures_are_drawn_once_of_the_same_numbers(monkeypatch):
    from discmech.studies.command.report import _drawn_once
    from discmech.studies.report import figures
    from tests.studies.fake_results import results

    drawn, render = [], figures.render
    monkeypatch.setattr(figures, "render", lambda *a: drawn.append(1) or render(*a))

    def page(result):
        definitions = {}
        return figures.plates(read(result), {}, definitions, _drawn_once(Store())), definitions

    (result,) = [r for r in results((16,)) if r["study"] == "energy"]
    del result["cases"][2:]
    first = page(result)
    count = len(drawn)
    assert count and page(result) == first and len(drawn) == count
    result["cases"].pop()
    assert page(result) != first and len(drawn) == 2 * count


@pytest.mark.slow
def test_figures_drawn_side_by_side_are_those_of_one_process(monkeypatch):
    from discmech.studies.command import report
    from discmech.studies.report import figures
    from tests.studies.fake_results import results

    few = read(*(r | {"cases": r["cases"][:2]} for r in results((16,))[1:3]))
    monkeypatch.setattr(report, "WORTH_DRAWING_TOGETHER", 1)
    monkeypatch.setattr(report, "worker_pool", partial(_counted, pools := [], report.worker_pool))
    collected = [{}, {}]
    pages = [
        figures.plates(few, {}, definitions, report._drawn_once(Store(fresh=True), jobs))
        for definitions, jobs in zip(collected, (1, 2), strict=True)
    ]
    assert pages[0] == pages[1] and collected[0] == collected[1] and pools == [1]


def _counted(pools, make, workers):
    pools.append(workers)
    return make(workers)


def test_a_case_that_cannot_be_used_is_not_kept(rows, monkeypatch):
    case = Case("order", scenes.get("kepler"), midpoint, 16)

    def refused(*_):
        raise BadInput("no.")

    monkeypatch.setattr(get("order").measuring, "measure", refused)
    assert side_by_side.measured(get("order"), case, store=Store()).unusable
    Store().save("run", "1", {})
    assert not rows()


@pytest.mark.slow
def test_ten_processes_share_one_store(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cases = [("harmonic", "rectangle"), ("harmonic", "midpoint"), ("pendulum", "rectangle")]
    asked = [cases[k % 3] for k in range(10)]

    def begun(k, cache):
        scene, rule = asked[k]
        words = ["order", scene, "--rule", rule, "--digits", "16", "--steps", "16"]
        python = [sys.executable, "-m", "discmech.studies.command"]
        return subprocess.Popen([*python, *words, "--json", f"{cache}-{k}.json"],
                                env=os.environ | {"DISCMECH_CACHE": str(tmp_path / cache)},
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)  # fmt: skip

    def found(name):
        return json_of(name)(tmp_path)["cases"]

    for k in range(3):  # undisturbed
        alone = begun(k, "alone")
        assert (alone.communicate()[1], alone.returncode) == (b"", 0)
    together = [begun(k, "shared") for k in range(10)]
    said = [(p.communicate()[1], p.returncode) for p in together]
    assert said == 10 * [(b"", 0)], said
    for k in range(10):
        assert found(f"shared-{k}.json") == found(f"alone-{k % 3}.json")
    with closing(
        sqlite3.connect(tmp_path / "shared" / "discmech-cache" / "results" / "store.sqlite")
    ) as file:
        assert file.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert file.execute("SELECT count(*) FROM entry WHERE kind = 'measurement'").fetchone() == (
            3,
        )


def test_a_changed_judge_may_ask_for_more_than_the_one_before():
    """What one verdict did not need is measured when another judge gives a verdict that does."""
    word = ["inconclusive"]

    class Asking(Study):
        name = "asking"

        def measure(self, case, progress):
            return {"measured": {"a": 1.0}}

        def judge(self, case, measurement):
            return Verdict("pass" if "lost" in measurement else word[0], "it is so.")

        def measure_more(self, case, measurement, said):
            return {"lost": 1.0} if said.verdict == "fail" else {}

    study, case = Asking(), Case("asking", scenes.get("pendulum"), midpoint, 16)
    found = one_case.measured_case(study, case)
    verdict = one_case.judged(study, case, found)
    assert one_case.asks_more(study, found, verdict)
    found = Found.of_json(one_case.with_more(study, case, found, verdict).to_json())
    assert not one_case.asks_more(study, found, one_case.judged(study, case, found))
    word[0] = "fail"
    verdict = one_case.judged(study, case, found)
    assert one_case.asks_more(study, found, verdict)
    found = one_case.with_more(study, case, found, verdict)
    assert found.more and one_case.judged(study, case, found).verdict == "pass"
