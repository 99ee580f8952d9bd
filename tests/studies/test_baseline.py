"""A baseline says what became worse, better, or cannot be told, and never calls noise a change."""

import errno
import os
import shutil
from dataclasses import replace
from functools import partial

import pytest

from discmech.integrators import BadInput, Scene, midpoint, pair
from discmech.integrators.errors import CouldNotRun
from discmech.studies import get
from discmech.studies.command.baselines import exit_beside
from discmech.studies.core import baseline
from discmech.studies.core.case import Choice
from discmech.studies.core.study import every_study
from tests.studies.as_json import read


def case(rule="midpoint", verdict="pass", order=2.001, rows=(), **more):
    return {"scene": "kepler", "rule": rule, "retraction": None, "digits": 16, "verdict": verdict,
            "command": f"discmech order kepler --rule {rule}", "rows": list(rows),
            "expected": {"order": 2, "tolerance": 0.05}, "measured": {"order": order},
            **more}  # fmt: skip


def result(*cases, **record):
    record = {"cpu": "one", "sympy": "1", "date": "d", "commit": "c", "seconds": 1.0} | record
    found = {"schema": baseline.SCHEMA, "study": "order", "notes": [], "cases": list(cases)}
    (whole,) = read(found | {"record": record})
    return whole


def timed(low, high):
    return case(rows=[{"setting": "h = 0.1", "seconds_low": low, "seconds_high": high}])


def with_errors(*errors, digits=50, used=True):
    rows = [{"steps": 10 * 2**k, "error": e, "used": used} for k, e in enumerate(errors)]
    return case(rows=rows, digits=digits)


def of(study, measured, expected=(), **more):
    return case(study=study, measured=measured, expected=dict(expected), **more)


def banded(band):
    return of("energy", {"band": band})


def drifting(drift, other=1e-15):
    limits = {"limit": 1e-14, "limits": {"p": 1e-14}, "not_demanded": "none is claimed"}
    return of("momentum", {"drift": {"p": drift, "q": other}}, limits, verdict="measured")


def defect(size):
    return of("symplecticity", {"poisson": size, "resolution": 1e-12}, {"not_demanded": "no"})


def stable(end):
    return of("stability", {"stable_to": end}, kind="linear")


def bounded(*outcomes, end=1.0):
    rows = [{"stiffness": 1.0, "class": outcome} for outcome in outcomes]
    return of("stability", {"limits": {"1": end}}, rows=rows)


def floored(floor, error=1e-3):
    return with_errors(error) | {"local": {"floor": floor}}


def demanding(*names):
    return of("energy", {"band": 1e-3}, names and {"not_demanded": "b", "demanded": [*names]})


FULL = ["bounded"] * 40


@pytest.mark.parametrize(("then", "now", "answer"), [
    (with_errors(1e-3, 2.5e-4), with_errors(1e-1, 2.5e-2), "worse"),  # the same order
    (with_errors(1e-3, 2.5e-4), with_errors(1e-3, 2.51e-4), "worse"),
    (with_errors(1e-3, 2.5e-4), with_errors(9e-4, 2.2e-4), "better"),
    (with_errors(1e-3, 2.5e-4), with_errors(1e-3, 2.5e-4), "equal"),
    (with_errors(1e-3, 1e-46), with_errors(1e-3, 3e-46), "equal"),  # round-off
    (with_errors(1e-3, 2.5e-4), with_errors(2e-3, 1e-4), "cannot tell"),
    (with_errors(1e-3, digits=16), with_errors(1.1e-3, digits=16), "worse"),
    (with_errors(1e-3, 2e-11, digits=16), with_errors(1.01e-3, 9e-11, digits=16), "equal"),
    (with_errors(1e-3, digits=16, used=False), with_errors(2e-3, digits=16, used=False),
     "same verdict"),
    (case(), case(order=0.998, expected={"order": 1, "tolerance": 0.05}), "worse"),
    (case(), case(order=4.001, expected={"order": 4, "tolerance": 0.05}), "better"),
    (banded(1e-3), banded(46e-3), "worse"),
    (banded(46e-3), banded(1e-3), "better"),
    (banded(1e-3), banded(1.2e-3), "cannot tell"),
    (banded(1e-3), banded(1e-3), "equal"),
    (banded(1e-14), banded(1.5e-14), "equal"),
    (banded(1e-3), of("energy", {}), "worse"),  # there is none now
    (drifting(1e-15), drifting(4e-6), "worse"),
    (drifting(4e-6), drifting(1e-15), "better"),
    (drifting(4e-6), drifting(4e-6, other=1e-7), "worse"),  # below the largest
    (drifting(1e-15), drifting(9e-15), "equal"),  # a walk of round-off
    (drifting(4e-6), drifting(4.2e-6), "cannot tell"),
    (defect(1e-16), defect(4e-2), "worse"),
    (defect(4e-2), defect(1e-16), "better"),
    (defect(4e-2), defect(9e-2), "same verdict"),  # at other places
    (defect(1e-16), defect(7e-13), "same verdict"),
    (stable(None), stable(2.0), "worse"),
    (stable(2.0), stable(2.0000001), "equal"),
    (stable(2.0), stable(3.46), "better"),
    (bounded(*FULL), bounded(*FULL, end=2.0), "better"),
    (bounded(*FULL), bounded(*FULL, end=1.01), "equal"),
    (bounded(*FULL), bounded(*FULL[:20], *["drifting"] * 20), "worse"),
    (floored(""), floored("1e-11 (numbers rounded to 11 decimals)"), "worse"),
    (floored("1e-11 (rounded)"), floored("1e-10 (rounded)"), "worse"),
    (floored("4e-08 (single precision)"), floored("9e-08 (single precision)"), "equal"),
    (floored("1e-11 (rounded)"), floored(""), "better"),
    (with_errors(1e-3, 1e-4) | {"local": {"floor": ""}},
     with_errors(2e-3, 5e-5) | {"local": {"floor": "1e-11 (rounded)"}}, "worse"),
    (demanding(), demanding("balance"), "worse"),
    (demanding("balance"), demanding(), "equal"),
    (case(), case(), "same verdict"),
    (case(), case(verdict="fail"), "worse"),
    (case(), case(verdict="inconclusive"), "worse"),
    (case(verdict="inconclusive"), case(verdict="fail"), "worse"),
    (case(verdict="fail"), case(), "better"),
    (case(order=2.001), case(order=2.04), "same verdict"),  # within what the verdict allows
    (case(order=2.0), case(order=1.8), "worse"),
    (case(order=1.8), case(order=2.0), "better"),
    (case(order=None), case(order=2.0), "same verdict"),
    (timed(1.0, 1.2), timed(1.1, 1.3), "equal"),
    (timed(1.0, 1.2), timed(1.3, 1.4), "cannot tell"),
    (timed(1.0, 1.2), timed(0.7, 0.9), "cannot tell"),
    (timed(1.0, 1.2), timed(1.9, 2.0), "worse"),
    (timed(1.0, 1.2), timed(0.5, 0.6), "better"),
])  # fmt: skip
def test_verdicts_and_all_figures_are_compared(then, now, answer):
    assert answers(result(then), result(now)) == [answer]


def answers(then, now):
    return [line.answer for line in baseline.compared("b", now, then).lines]


def test_times_of_another_machine_cannot_be_told_and_the_difference_is_named():
    then, now = result(timed(1.0, 1.2)), result(timed(9.0, 9.1), cpu="two")
    found = baseline.compared("b", now, then)
    assert [line.answer for line in found.lines] == ["cannot tell"]
    assert found.environment == [("cpu", "one", "two")]
    worse = result(case(verdict="fail"), cpu="two")  # a verdict depends on no machine
    assert answers(then, worse) == ["worse"]


SCENE = {"k": "1", "x0": "2", "lagrangian": "digest 12"}


@pytest.mark.parametrize(("changes", "said"), [
    ({"k": "1/2"}, "another: k = 1 -> 1/2;"), ({"fast": "1"}, "fast = none -> 1"),
    ({"lagrangian": "digest 13"}, "lagrangian is another"), ({"step": "digest 1"}, "step is"),
])  # fmt: skip
def test_a_result_of_another_scene_cannot_be_compared(changes, said):
    now = replace(result(case(order=2.0)), asked={"kepler": SCENE | changes})
    for earlier, words in ((SCENE, said), (None, "does not say which values kepler had")):
        then = replace(result(case(order=1.8)), asked=earlier and {"kepler": earlier})
        (line,) = baseline.compared("b", now, then).lines
        assert line.answer == "cannot be compared" and words in line.why
        assert exit_beside(replace(now, baseline=baseline.compared("b", now, then)), 0) == 3
        assert baseline.compared("b", now, now).lines[0].answer == "same verdict"


def test_the_values_of_a_scene_are_its_own_and_no_comments_or_names_of_files():
    one, same, other = (
        Scene("a", pair(1), f, parameters={"k": "1/2"}, x0=[1], v0=[0], source=source)
        for f, source in [(lambda x, v, p: v[0] ** 2 / 2 - p.k * x[0] ** 2, "a book"),
                          (lambda x, v, p: v[0] ** 2 / 2 - p.k * x[0] ** 2, ""),
                          (lambda x, v, p: v[0] ** 2 / 2 + p.k * x[0] ** 2, "")])  # fmt: skip
    asked = [baseline.asked_of([get("order")], Choice((scene,), (midpoint,)))["a"]
             for scene in (one, same, other)]  # fmt: skip
    assert asked[0] == asked[1] and asked[0]["k"] == "1/2" and asked[0]["duration"] == "10"
    assert {k for k in asked[0] if asked[0][k] != asked[2][k]} == {"lagrangian"}


@pytest.mark.parametrize("study", every_study().values(), ids=lambda study: study.name)
def test_each_study_says_of_which_values_its_cases_are_asked(study):
    asked = baseline.asked_of([study], Choice())
    assert all("duration" in values for values in asked.values())
    assert asked == baseline.asked_of([study], Choice())


def test_a_method_that_is_self_adjoint_no_longer_is_worse():
    then, lost, unknown = (
        replace(result(case()), schemes=[{"scene": "kepler", "rule": "midpoint",
                                          "retraction": None, "self_adjoint": value}])
        for value in (True, False, None))  # fmt: skip
    assert answers(then, lost) == answers(then, unknown) == ["worse", "same verdict"]
    assert answers(lost, then) == ["better", "same verdict"]
    assert answers(then, then) == answers(lost, unknown) == ["same verdict"]
    assert "self-adjoint, now not self-adjoint" in baseline.compared("b", lost, then).lines[0].why


def test_what_other_words_leave_out_cannot_be_compared_and_what_is_gone_is_worse():
    then = replace(result(case("a"), case("b")), command="discmech verify f.py")
    now = replace(result(case("a")), command="discmech verify f.py")
    assert answers(then, now) == ["worse", "same verdict"]
    fewer = replace(now, command="discmech verify f.py --study order")
    assert answers(then, fewer) == ["cannot be compared", "same verdict"]


def test_the_worse_come_first_and_what_is_new_cannot_be_told():
    then = result(case("a"), case("b"), case("c"), case("d", verdict="fail"))
    now = result(case("a"), case("e"), case("c", verdict="fail"), case("d"))
    assert answers(then, now) == ["worse", "worse", "cannot tell", "better", "same verdict"]


def test_a_baseline_of_other_cases_is_refused():
    with pytest.raises(BadInput, match="none of these cases"):
        baseline.compared("b", result(case("a")), result(case("b")))


@pytest.mark.parametrize("name", ["", "../x", "a/b", "a b", ".hidden", "x" * 99])
def test_a_name_is_a_name(name):
    with pytest.raises(BadInput, match="a baseline's name is"):
        baseline.checked_name(name)


def harm_in_place(path):
    path.write_bytes(path.read_bytes().replace(b"pass", b"fail"))


def exchange(path):
    path.write_text("somebody else's file of this name")


@pytest.mark.parametrize("harm", [harm_in_place, exchange, pytest.param(
    lambda path: path.chmod(0o666), id="rights", marks=pytest.mark.skipif(
        not hasattr(os, "geteuid"), reason="rights are no bits"))])  # fmt: skip
def test_a_damaged_one_is_refused_and_stays_and_an_absent_one_is_none(harm):
    assert baseline.load("b", "order") is None
    path = baseline.save("b", result(case()))
    assert baseline.load("b", "order") == result(case())
    harm(path)
    harmed = path.read_bytes()
    for ask in (partial(baseline.load, "b", "order"), partial(baseline.save, "b", result(case())),
                partial(baseline.check_kept, "b", "order")):  # fmt: skip
        with pytest.raises(BadInput, match=r"is damaged, or not yours alone: move it away"):
            ask()
    assert path.read_bytes() == harmed


def test_a_cleared_cache_takes_no_baseline_along(tmp_path):
    baseline.save("b", result(case()))
    shutil.rmtree(tmp_path / "cache")
    assert baseline.load("b", "order") == result(case())


def test_one_of_another_schema_is_refused():
    baseline.save("b", replace(result(case()), schema=baseline.SCHEMA + 1))
    with pytest.raises(BadInput, match="another version of discmech"):
        baseline.load("b", "order")


def test_a_gate_that_would_never_compare_is_refused(monkeypatch, ask, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setattr(baseline, "baseline_folder", lambda: tmp_path / "file")
    words = ("order", "harmonic", "--rule", "rectangle", "--digits", "16", "--baseline", "main")
    code, out, err = ask(*words)
    assert code == 2 and not out and "the baseline main cannot be kept" in err


def test_a_full_disk_is_a_sentence(monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    baseline.save("b", result(case()))
    monkeypatch.setattr("os.replace", full)
    with pytest.raises(CouldNotRun, match="No space left"):
        baseline.save("b", result(case(verdict="fail")))
    assert baseline.load("b", "order") == result(case())


@pytest.mark.slow
def test_from_the_command_line(ask):
    words = ("order", "harmonic", "--rule", "rectangle", "--digits", "16", "--baseline", "main")
    code, out, _ = ask(*words)
    assert code == 0 and "saved as the baseline main (there was none)" in out
    code, out, _ = ask(*words)
    assert code == 0 and "beside main" in out and "1 equal" in out
    saved = baseline.load("main", "order")
    (one,) = saved.cases

    def save(**changed):
        baseline.save("main", replace(saved, cases=[replace(one, **changed)]))

    save(figures={**one.figures, "order": one.wanted["order"] + 0.2})
    assert "better" in ask(*words)[1]
    save(verdict="inconclusive", figures={**one.figures, "order": None})
    assert ask(*words)[0] == 0
    code, out, _ = ask(*words, "--save-baseline", "main")
    assert "saved as the baseline main:" in out
    save(command=f"{one.command} and more")
    assert ask(*words)[0] == 2  # of other cases
    assert ask(*words[:-1], "../x")[0] == 2
