"""Results are measured once, kept, and found again; what is damaged is not believed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from functools import partial

import pytest

from discmech.integrators import scenes
from discmech.integrators.rules import midpoint
from discmech.studies import get
from discmech.studies.command import INTERRUPTED
from discmech.studies.command.entry import main
from discmech.studies.core import fingerprint, side_by_side
from discmech.studies.core.case import Case, Choice
from discmech.studies.core.running import run_study
from discmech.studies.core.store import Store, unsealed_json
from tests.kill_points import json_of

CHOICE = Choice(scenes=tuple(map(scenes.get, ("kepler", "rigid-body", "heavy-top"))),
                rules=(midpoint,), digits=(16,), steps=10)  # fmt: skip
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


@pytest.fixture
def entries(tmp_path):
    return lambda: sorted((tmp_path / "cache" / "results").glob("*/*"))


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


def test_without_a_store_nothing_is_kept(study, entries):
    run_study(get("momentum"), CHOICE)
    assert not entries()


@pytest.mark.parametrize("damage", [b"", b"half", b"\xff\xfe", b"0\n{}", b"5", b"[]"])
def test_a_damaged_entry_is_measured_again(study, entries, damage):
    study()
    for path in entries():
        path.write_bytes(damage)
    measured, found = study()
    assert measured == ALL and any("damaged" in note for note in found["notes"])
    assert study()[0] == []


def test_an_entry_in_the_place_of_another_is_not_believed(study, entries):
    study()
    first, second, *_ = entries()
    shutil.copy(first, second)
    assert len(study()[0]) == 1


def test_a_store_that_cannot_be_written_says_so_and_loses_nothing(study, monkeypatch):
    def full(path, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("discmech.integrators.compiler.cache.write_atomically", full)
    measured, found = study()
    assert measured == ALL and len(found["cases"]) == 3
    assert any("No space left on device" in note for note in found["notes"])


def test_the_longest_unused_entries_go_first(study, entries, monkeypatch):
    study()
    for age, path in enumerate(entries()):
        os.utime(path, (1e9 - age, 1e9 - age))
    newest = entries()[0]
    monkeypatch.setattr("discmech.studies.core.store.MOST", 2)
    Store().prune()
    assert newest in entries() and len(entries()) < 3


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
    result = {"verdict": "fail", "control": False}
    store = Store()
    side_by_side._kept(store, get("order"), "a" * 64, result)
    side_by_side._kept(store, get("order"), "b" * 64, {**result, "control": True})
    side_by_side._kept(store, get("stability"), "c" * 64, result)  # tells none
    assert side_by_side.found_by(store, "a" * 64) == result
    monkeypatch.setattr(fingerprint, "_text_of_all", lambda: "changed")
    assert side_by_side.found_by(store, "a" * 64) is None
    assert side_by_side.found_by(store, "b" * 64)["control"]
    assert side_by_side.found_by(store, "c" * 64) == result


def test_figures_are_drawn_once_of_the_same_numbers(monkeypatch):
    from discmech.studies.command.report import _drawn_once
    from discmech.studies.report import figures
    from tests.studies.fake_results import results

    drawn, render = [], figures.render
    monkeypatch.setattr(figures, "render", lambda *a: drawn.append(1) or render(*a))

    def page(result):
        definitions = {}
        return figures.plates([result], {}, definitions, _drawn_once(Store())), definitions

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

    few = [r | {"cases": r["cases"][:2]} for r in results((16,))[1:3]]
    monkeypatch.setattr(report, "WORTH_DRAWING_TOGETHER", 1)
    monkeypatch.setattr(report, "worker_pool", partial(_counted, pools := [], report.worker_pool))
    collected = [{}, {}]
    pages = [
        figures.plates(few, {}, definitions, report._drawn_once(Store(fresh=True), jobs))
        for definitions, jobs in zip(collected, (1, 2), strict=True)
    ]
    assert pages[0] == pages[1] and collected[0] == collected[1] and pools == [2]


def _counted(pools, make, workers):
    pools.append(workers)
    return make(workers)


def test_a_case_that_cannot_be_used_is_not_kept(entries, monkeypatch):
    case = Case("order", scenes.get("kepler"), midpoint, 16)
    monkeypatch.setattr(side_by_side, "run_case", lambda *_: {"unusable": True})
    assert side_by_side.measured(get("order"), case, store=Store()) == {"unusable": True}
    assert not entries()


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
    files = [p for p in (tmp_path / "shared" / "results").rglob("*") if p.is_file()]
    assert files and all(unsealed_json(p) and p.suffix != ".new" for p in files)
