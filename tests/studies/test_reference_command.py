"""discmech reference: answers, exit codes, tables; digits that others published, costs."""

import json
import shutil
from dataclasses import replace

import mpmath
import pytest

from discmech.reference import solution
from discmech.reference.answer import frozen, store
from discmech.reference.answer.solution import forget
from discmech.studies.command.entry import main
from discmech.studies.core.case import Choice
from discmech.studies.core.study import every_study
from discmech.tests.bench.references import measuring as costs
from discmech.tests.bench.references import published


@pytest.fixture(autouse=True)
def own_references(tmp_path, monkeypatch):
    (tmp_path / "references").mkdir()
    monkeypatch.setattr(
        "discmech.reference.answer.cache.folders", lambda: [tmp_path / "references"]
    )


def ask(capsys, *words):
    code = main(["reference", *words])
    shown = capsys.readouterr()
    return code, shown.out, shown.err


def test_an_answer_as_json_and_in_words(capsys, tmp_path):
    file = tmp_path / "kepler.json"
    code, out, _ = ask(capsys, "kepler", "--time", "-1/3", "--digits", "40", "--json", str(file))
    found = json.loads(file.read_text(encoding="utf-8"))
    assert code == 0 and "40 certain digits" in out
    exact = solution("kepler", "-1/3", digits=60)
    with mpmath.workdps(70):
        for name in ("x", "v", "mu"):
            for text, number in zip(found[name], getattr(exact, name), strict=True):
                assert abs(mpmath.mpf(text) - number) <= abs(number) * mpmath.mpf(10) ** -39
    assert found["certain_digits"] == 40 and found["time"] == "-1/3"
    assert found["certainty"] == "enclosure" and found["attitude"] is None


def test_the_time_is_the_duration_and_the_attitude_is_there(capsys):
    code, out, _ = ask(capsys, "rigid-body", "--attitude", "--json", "-")
    found = json.loads(out)
    assert code == 0 and found["time"] == "10" and len(found["attitude"]) == 3
    assert found["certainty"] == "enclosure" and float(found["bound"]) < 1e-50


@pytest.mark.parametrize("words, message", [
    ([], "name one SCENE"),
    (["keppler"], 'no scene "keppler": did you mean kepler'),
    (["kepler", "--time", "soon"], "t='soon' is not an exact finite number"),
    (["kepler", "--digits", "many"], "--digits is 'many'"),
    (["kepler", "--digits", "0"], "--digits is '0'"),
    (["kepler", "--attitude"], "pair groupoid, which has no attitude"),
    (["kepler", "--json", "/dev/null/all.json"], "cannot be written"),
    (["kepler", "--check", "kepler"], "name one SCENE, or ask for"),
    (["--rebuild", "keppler"], 'no scene "keppler"'),
])  # fmt: skip
def test_bad_questions(capsys, words, message):
    code, _, err = ask(capsys, *words)
    assert code == 2 and message in err and err.count("\n") == 1


def test_zeros_at_the_end_are_digits_too(capsys):
    """At rest, and at a time whose 30th digit is a zero: as many digits as are certain."""
    for words in (["harmonic", "--time", "0", "--digits", "30"], ["kepler", "--digits", "31"]):
        _, out, _ = ask(capsys, *words, "--json", "-")
        found = json.loads(out)
        for text in [*found["x"], *found["v"]]:
            digits = text.lstrip("-").partition("e")[0].replace(".", "").lstrip("0")
            assert len(digits) == (found["certain_digits"] if digits else 0), text


def test_too_few_digits_are_inconclusive(capsys, monkeypatch):
    import discmech.reference as reference

    def poorer(*question):
        return replace(solution(*question), certain_digits=7)

    monkeypatch.setattr(reference, "solution", poorer)
    code, out, _ = ask(capsys, "harmonic")
    assert code == 3 and "7 certain digits" in out


def test_tables_are_checked_refused_and_mended(capsys, tmp_path, monkeypatch):
    shutil.copytree(frozen.FOLDER, tmp_path / "tables")
    monkeypatch.setattr(frozen, "FOLDER", tmp_path / "tables")
    file = tmp_path / "tables" / "harmonic.json"
    assert ask(capsys, "--check", "harmonic")[0] == 0
    file.write_text(file.read_text(encoding="utf-8").replace("9", "8", 1), encoding="utf-8")
    forget()
    for words, expected in ((["--check", "harmonic"], 1), (["harmonic"], 2)):
        code, out, err = ask(capsys, *words)
        said = out if expected == 1 else err
        assert code == expected and "harmonic.json does not fit its checksum" in said
        assert "discmech reference --rebuild harmonic" in said
    code, out, _ = ask(capsys, "--rebuild", "harmonic")
    assert code == 0 and "4 times, 50 digits by enclosure" in out
    assert ask(capsys, "harmonic")[0] == 0


def test_a_table_of_another_scene_fails_the_check(capsys, monkeypatch):
    monkeypatch.setattr(frozen, "_read", lambda path: replace(store.read(path), key="another"))
    code, out, _ = ask(capsys, "--check", "harmonic")
    assert code == 1 and "harmonic.json was made for another harmonic" in out


def test_a_wrong_table_fails(capsys, monkeypatch):
    from discmech.reference.failures import Uncertain, WrongDigits

    for failure, expected in ((WrongDigits, 1), (Uncertain, 3)):

        def raises(name, failure=failure):
            raise failure("what is wrong")

        monkeypatch.setattr(frozen, "check", raises)
        code, out, _ = ask(capsys, "--check", "harmonic")
        assert code == expected and "what is wrong" in out


SCD = {  # the digits of the published numbers that are right: of 16, 30, 29, 14 and 10 printed ones
    "pleiades": 14.53,
    "arenstorf, four loops": 26.43,
    "arenstorf, three loops": 25.51,
    "figure eight": 12.97,
    "butterfly": 9.22,
}


@pytest.mark.slow
@pytest.mark.parametrize("problem", SCD)
def test_published_digits(problem, monkeypatch):
    """Pinned: these numbers are other people's, and do not change."""
    (entry,) = [e for e in published.problems() if e.problem == problem]
    monkeypatch.setattr(published, "problems", lambda: [entry])
    (row,) = published.measure()
    assert row["scd"] == pytest.approx(SCD[problem], abs=0.011)
    assert row["certain"] == row["printed"] + published.MARGIN
    assert min(value["right"] for value in row["values"]) == pytest.approx(row["scd"], abs=0.011)


@pytest.mark.slow
def test_published_digits_of_another_problem_are_not_right(monkeypatch):
    """Negative control: the moon a millionth heavier."""
    (entry,) = [e for e in published.problems() if e.problem == "arenstorf, three loops"]
    scene = entry.scene.with_values(parameters={"moon": "0.012277472"})
    monkeypatch.setattr(published, "problems", lambda: [replace(entry, scene=scene)])
    assert published.measure()[0]["scd"] < 6


def test_costs_as_table_and_page(capsys, monkeypatch, tmp_path):
    for name, values in (("DIGITS", (15, 40)), ("TIMES", (1, 2))):
        monkeypatch.setattr(costs, name, values)
    file, folder = tmp_path / "costs.json", tmp_path / "page"
    code = main(["references", "--folder", str(folder), "--json", str(file)])
    out = capsys.readouterr().out
    assert code == 0 and "Seconds grow like digits^" in out
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["verdict"] == "pass" and len(found["cases"]) == 4
    for case in found["cases"]:
        row = case["measured"]
        assert row["proven"] >= row["digits"] and row["certainty"] == "enclosure"
        assert row["seconds"] > 0 and row["steps"] > 0
    assert (folder / "figures" / "reference-costs.png").stat().st_size > 5000
    assert "Seconds grow like digits^" in (folder / "index.html").read_text(encoding="utf-8")


def test_digits_that_are_not_proven_fail():
    case = costs.cases(Choice())[0]
    found = {"measured": costs.measure(case)["measured"] | {"proven": 14}}
    said = every_study()["references"].judge(case, found)
    assert said.verdict == "fail" and "only 14 digits" in said.reason
    assert costs.notes(Choice()) == ["discmech references --thorough goes on to more."]
