"""A study in a user's file or package: a command like the others, and one sentence for mistakes."""

from __future__ import annotations

import json
import sys
from importlib import invalidate_caches
from typing import ClassVar

import mpmath
import pytest

from discmech import BadInput, check
from discmech.integrators.scene import Opaque
from discmech.studies import Study, Verdict
from discmech.studies.command import main
from discmech.studies.core import study as room
from discmech.studies.core import userfile
from discmech.studies.core.fingerprint import text_of_study
from discmech.studies.core.study_lookup import study_called

FILE = """
from discmech.studies import Study

class Energy(Study):
    name = "own-energy"
    limits = {"most": LIMIT}

    def measure(self, case, progress):
        run = case.scheme.flow(case.scene.step, case.digits).trajectory(case.steps or 50)
        return {"measured": {"most": abs(run.mu).max()}, "rows": [{"mu": m} for m in run.mu[:3]]}

STUDY = Energy()
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Write the study with this limit; its command's words."""
    monkeypatch.chdir(tmp_path)

    def written(limit, **replaced):
        text = FILE.replace("LIMIT", str(limit))
        for old, new in replaced.items():
            text = text.replace(old, new)
        (tmp_path / "own.py").write_text(text, encoding="utf-8")
        return ["own.py:own-energy"]

    return written


def asked(capsys, *words):
    code = main([*words, "--json", "-"])
    return code, json.loads(capsys.readouterr().out)


def test_a_limit_judges_and_a_change_of_it_is_seen(file, capsys):
    scenes = ["pendulum", "harmonic", "--rule", "midpoint"]
    code, found = asked(capsys, *file(1e3), *scenes)
    assert code == 0 and found["verdict"] == "pass" and found["study"] == "own-energy"
    assert found["cases"][0]["command"].startswith("discmech own.py:own-energy pendulum --rule")
    code, again = asked(capsys, *file(1e3), *scenes)
    assert again["remembered"] == 2
    code, found = asked(capsys, *file(1e-3), *scenes)
    assert code == 1 and found["remembered"] == 0
    assert "most is" in found["cases"][0]["reason"] and "above 0.001" in found["cases"][0]["reason"]


BESIDE = {
    "module": ("import beside", "beside.FACTOR", "beside.py", "FACTOR = 1e{}"),
    "package": ("from parts.values import FACTOR", "FACTOR", "parts/values.py", "FACTOR = 1e{}"),
    "late": ("", "__import__('beside').FACTOR", "beside.py", "FACTOR = 1e{}"),
    "data": ("import numpy", "numpy.loadtxt('data.txt')", "data.txt", "1e{}"),
    "file": ("", "float(open('data.txt').read())", "data.txt", "1e{}"),
}


@pytest.mark.parametrize("kind", BESIDE)
def test_a_change_of_what_it_reads_is_seen(file, tmp_path, kind, monkeypatch):
    """Its text has another digest, or none, so that nothing kept of it is used."""
    imported, value, beside, text = BESIDE[kind]
    (tmp_path / "parts").mkdir()
    edits = {"class Energy": f"{imported}\n\nclass Energy", "abs(run.mu).max()": value}
    (word,) = file(1e3, **edits)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    found = []
    for power in (0, 9):
        (tmp_path / beside).write_text(text.format(power), encoding="utf-8")
        monkeypatch.setattr(userfile, "_loaded", {})  # as in a process of its own
        for name in ("beside", "parts", "parts.values"):
            sys.modules.pop(name, None)
        invalidate_caches()
        try:
            found.append(text_of_study(study_called(word)))
        except Opaque:
            found.append(None)
    assert found[0] is None or found[0] != found[1]
    assert (None in found) == (kind in ("late", "data", "file"))


def test_other_processes_find_it_again(file, capsys):
    rules = [
        w for r in ("midpoint", "rectangle", "trapezoidal", "lobatto-3") for w in ("--rule", r)
    ]
    scenes = ["pendulum", "kepler", "harmonic"]
    code, found = asked(capsys, *file(1e3), *scenes, *rules, "--jobs", "2")
    assert code == 0 and len(found["cases"]) == 12


class Kept(Study):
    """It keeps the digits of the case in plain arithmetic."""

    name, limits = "kept", {"lost": 1e-45}

    def measure(self, case, progress):
        third = mpmath.mpf(1) / 3 if case.digits > 16 else 0
        return {"measured": {"lost": abs(3 * (-third) + (case.digits > 16))}}


def test_numbers_keep_the_digits_of_the_case():
    assert check(Kept(), ["pendulum"], ["midpoint"], digits=[50])["verdict"] == "pass"


def test_what_nothing_could_fail_is_inconclusive():
    class Nothing(Kept):
        limits = {}

    assert check(Nothing(), ["pendulum"], ["midpoint"])["verdict"] == "inconclusive"


def test_what_is_above_its_limit_fails_though_another_is_missing():
    class Both(Kept):
        limits: ClassVar = {"missing": 1, "lost": -1}

    assert check(Both(), ["pendulum"], ["midpoint"])["verdict"] == "fail"


@pytest.mark.parametrize("value", [None, float("nan")])
def test_a_quantity_that_is_no_number_is_inconclusive(value):
    class Lost(Kept):
        def measure(self, case, progress):
            return {"measured": {"lost": value}}

    assert check(Lost(), ["pendulum"], ["midpoint"])["verdict"] == "inconclusive"


MISTAKES = {
    "raises": ("1e3", {"abs(run.mu).max()": "1 / 0"}, "ZeroDivisionError: division by zero (own"),
    "no-dict": ("1e3", {"return {": "return []; {"}, "measure() gave []: return"),
    "no-number": ("1e3", {"abs(run.mu).max()": "object()"}, "give numbers, words, lists and dicts"),
    "a-class": ("1e3", {"STUDY = Energy()": "STUDY = Energy"}, "write STUDY = Energy()"),
    "a-name": ("1e3", {'"own-energy"': '"Own Energy"'}, "use small letters, digits and dashes"),
    "no-measure": ("1e3", {"def measure": "def measures"}, "has no measure(self, case, progress)"),
    "a-verdict": ("1e3", {"STUDY =": "    def judge(self, case, measurement):\n"
                                     "        return 'good'\n\nSTUDY ="}, "gave 'good': return"),
}  # fmt: skip


@pytest.mark.parametrize("limit, replaced, said", MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_one_sentence(file, capsys, limit, replaced, said):
    assert main([*file(limit, **replaced), "pendulum", "--rule", "midpoint"]) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1


def test_a_name_of_ours_is_refused(file, capsys):
    file("1e3", **{'"own-energy"': '"energy"'})
    assert main(["own.py", "pendulum", "--rule", "midpoint"]) == 2
    assert "the name energy is taken" in capsys.readouterr().err


def test_what_is_no_study_is_refused():
    for thing, said in ((Kept, "it is the class: give Kept()"), (3, "it is no Study")):
        with pytest.raises(BadInput, match=said.replace("(", r"\(").replace(")", r"\)")):
            check(thing, ["pendulum"], ["midpoint"])


class Point:
    """An entry point of a package."""

    value = "their.module:STUDY"

    def __init__(self, loads):
        self.load = loads


def broken():
    raise ImportError("no module their")


def test_a_package_brings_studies(monkeypatch):
    def points(group):
        assert group == "discmech.studies"
        return [Point(Kept), Point(broken), Point(lambda: 3)]

    monkeypatch.setattr(room, "entry_points", points)
    with pytest.warns(UserWarning, match="left out") as told:
        found = room.every_study.__wrapped__()
    assert "kept" in found and len(found) == len(room.every_study()) + 1
    said = " ".join(str(w.message) for w in told)
    assert "ImportError: no module their" in said and "it is no Study" in said


def test_a_verdict_of_its_own():
    class Judged(Kept):
        def judge(self, case, measurement):
            return Verdict("fail", "it always fails.")

    (case,) = check(Judged(), ["pendulum"], ["midpoint"])["cases"]
    assert case["verdict"] == "fail" and case["reason"] == "it always fails."
