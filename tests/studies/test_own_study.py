"""A study in a user's file or package: a command like the others, and one sentence for mistakes."""

from __future__ import annotations

import json
import sys
from importlib import invalidate_caches
from typing import ClassVar

import mpmath
import numpy as np
import pytest

from discmech import BadInput, Scheme, black_box, cayley, check, lie_group, scenes, so
from discmech.integrators.groupoids import GroupChart
from discmech.integrators.numbers import arithmetic
from discmech.integrators.scene import Opaque
from discmech.studies import Study, Verdict
from discmech.studies.command import main
from discmech.studies.core import study as room
from discmech.studies.core import userfile
from discmech.studies.core.fingerprint import text_of_study
from discmech.studies.core.study_words import study_called

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


@pytest.mark.slow
def test_other_processes_find_it_again(file, capsys):
    rules = [
        w for r in ("midpoint", "rectangle", "trapezoidal", "lobatto-3") for w in ("--rule", r)
    ]
    scenes = ["pendulum", "kepler", "harmonic"]
    code, found = asked(capsys, *file(1e3), *scenes, *rules, "--jobs", "2")
    assert code == 0 and len(found["cases"]) == 12


class Kept(Study):
    """It tells the digits that its measure has, in plain arithmetic with a row of a run."""

    name, limits = "kept", {"lost": 1e-45}

    def measure(self, case, progress):
        run = case.scheme.flow(case.scene.step, case.digits).trajectory(1)
        return {"measured": {"lost": lost(run.mu[-1][0]) if case.digits > 16 else 0}}


def lost(number=1):
    """Return the error of √(2 z²)² = 2 z² at the digits of mpmath; 0 would be no answer."""
    square = mpmath.mpf(2) * number**2
    return abs(mpmath.sqrt(square) ** 2 - square) + mpmath.eps * square


def test_numbers_keep_the_digits_of_the_case():
    assert check(Kept(), ["pendulum"], ["midpoint"], digits=[50])["verdict"] == "pass"


def of_study(seen):
    """Let each function of a study tell; none is a pass, so that all are asked."""

    class Told(Kept):
        def measure(self, case, progress):
            seen("measure")
            return super().measure(case, progress)

        def judge(self, case, measurement):
            seen("judge")
            return Verdict("fail", "it always fails.")

        def measure_more(self, case, measurement, said):
            seen("measure_more")
            return {}

        def diagnose(self, case, measurement):
            seen("diagnose")

    check(Told(), ["pendulum"], ["midpoint"], digits=[50])


def of_box(seen):
    """Let a box tell that is a function, of a step and of a run, and its change of coordinates."""

    def step(q, p, h, system):
        seen("step")
        return q + h * system.velocity(q, p), p

    def run(q, p, h, steps, every, system):
        seen("run")
        return np.array([q] * (steps // every + 1)), np.array([p] * (steps // every + 1))

    def turned(name):
        def change(q, p):
            seen(name)
            return q, p

        return change

    way = {"read": turned("read"), "write": turned("write")}
    for function, options in ((step, way), (step, {"state": "qv"}), (run, {"runs": True})):
        made = black_box(numbers="any", name="told", **options)(function)
        flow = Scheme(scenes.get("pendulum"), made).flow("1/10", 50)
        flow.trajectory(2, progress=lambda k: seen("progress"))


def of_memory(seen):
    """Let a box tell that is a class."""

    class Told:
        def start(self, q, p, h):
            seen("start")
            return q, p

        def step(self, state, h):
            seen("step")
            return state

        def read(self, state):
            seen("read")
            return state

    Scheme(scenes.get("pendulum"), black_box(numbers="any")(Told)).flow("1/10", 50).trajectory(2)


def of_retraction(seen):
    """Let a retraction tell, which has no product of its own."""

    class Told(type(cayley)):
        def element_in(self, frame, xi):
            seen("element_in")
            return super().element_in(frame, xi)

        def coordinates_in(self, frame, g):
            seen("coordinates_in")
            return super().coordinates_in(frame, g)

    chart = GroupChart(lie_group(so(3), Told()), arithmetic(50))
    chart.coordinates(chart.element(chart.array([[1, 2, 3]])[0] / 8))


HOOKS = {
    of_study: {"measure", "judge", "measure_more", "diagnose"},
    of_box: {"step", "run", "read", "write", "progress"},
    of_memory: {"start", "step", "read"},
    of_retraction: {"element_in", "coordinates_in"},
}


@pytest.mark.parametrize("hooks", HOOKS, ids=lambda hooks: hooks.__name__)
def test_a_function_of_a_user_computes_with_the_digits_that_are_asked(hooks):
    """Wherever one is called with numbers of 50 digits, mpmath has as many; afterwards its own."""
    told, before = {}, mpmath.mp.prec
    hooks(lambda name: told.setdefault(name, []).append((mpmath.mp.dps, lost())))
    assert set(told) == HOOKS[hooks] and mpmath.mp.prec == before
    assert all(digits >= 50 and 0 < off < 1e-50 for each in told.values() for digits, off in each)


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
