"""discmech verify: what runs on what, verdicts as they come, table, JSON, page and exit code."""

import io
import json
from dataclasses import replace
from fractions import Fraction
from functools import partial

import pytest
from rich.console import Console

from discmech import vary
from discmech.integrators import BadInput, rules, scenes
from discmech.studies import get
from discmech.studies.core import lookup
from discmech.studies.core.case import Choice
from discmech.studies.core.fingerprint import of_proof
from discmech.studies.core.plan import Plan
from discmech.studies.core.result import Result, StudyResult, result_of
from discmech.studies.core.store import Store
from discmech.studies.proof import proving
from discmech.studies.report import verdicts
from discmech.studies.report.tables import print_result
from discmech.studies.stability.view import VIEW as STABILITY
from discmech.studies.user import verify as verifying
from discmech.studies.user.verify import (
    ON_PAIRS,
    RULES,
    SCENES,
    Request,
    studies,
    usual_scenes,
    verify,
)
from tests.studies.test_userfile import RULE, SCENE

QUICK = ("--study", "order", "--study", "symplecticity", "--digits", "50", "--jobs", "1")
WRONG = RULE.replace("two_thirds", "a_third").replace("2 * h / 3), u) / 2", "h / 3), u) / 2")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty current folder with a good rule, a wrong one, and one with a scene."""
    monkeypatch.chdir(tmp_path)
    for name, text in (("good", RULE), ("wrong", WRONG), ("both", RULE + SCENE), ("scene", SCENE)):
        (tmp_path / f"{name}.py").write_text(text)
    return tmp_path


def test_the_six_scenes_cover_every_groupoid():
    kinds = {(s.groupoid.kind, "connection" in s.groupoid.name) for s in map(scenes.get, SCENES)}
    every = {(s.groupoid.kind, "connection" in s.groupoid.name) for s in scenes.all_scenes()}
    assert kinds == every and len(SCENES) == 6
    assert {"se(3)", "so(3)"} <= {scenes.get(n).groupoid.name[6:-1] for n in SCENES}


def test_only_studies_that_take_no_times_run_unasked():
    assert studies()[:4] == ("order", "symplecticity", "momentum", "energy")
    assert "work-precision" not in studies() and "savings" not in studies()


def test_what_waits_for_a_reference_comes_last_and_equal_runs_next_to_each_other():
    plan = Plan([get(name) for name in studies()[:4]], Request(files=("midpoint",)).choice())
    (first, *_) = plan.tasks(set(), set())
    cases = [(plan.studies[i].name, plan.case((i, k)).digits) for i, k in first.places]
    assert cases == [
        ("momentum", 50), ("symplecticity", 50), ("momentum", 16), ("energy", 16),
        ("symplecticity", 16), ("order", 50), ("order", 16),
    ]  # fmt: skip


def test_a_scene_of_the_file_joins_in_and_one_alone_is_asked_about(folder):
    def chosen(**request):
        choice = Request(**request).choice()
        return [s.name for s in choice.scenes], [r.name for r in choice.rules]

    assert chosen(files=("good.py",)) == (list(SCENES), ["two-thirds"])
    assert chosen(files=("both.py",)) == (["my-pendulum", *SCENES], ["two-thirds"])
    assert chosen(files=("scene.py",)) == (["my-pendulum"], ["midpoint", "trapezoidal"])
    form = "one_form=lambda x, p: [x[1], 0], hamiltonian=lambda x, p: x[0] * x[1]"
    text = f'from discmech import Scene, pair\nlv = Scene("lv", pair(2), x0=[1, 2], {form})\n'
    (folder / "form.py").write_text(text)
    assert chosen(files=("form.py",)) == (["lv"], ["projected-gauss-1", "degenerate-gauss-1"])
    assert chosen(files=("good.py",), scenes=("scene.py:my-pendulum",))[0] == ["my-pendulum"]
    assert len(chosen(files=("both.py",), every_scene=True)[0]) == 1 + len(scenes.names())


@pytest.mark.parametrize(("name", "rules", "own"), [
    ("two_thirds", ["two-thirds"], []),
    ("two-thirds", ["two-thirds"], []),
    ("my-pendulum", list(RULES), ["my-pendulum"]),
    ("mine", list(RULES), ["my-pendulum"]),
])  # fmt: skip
def test_one_rule_or_scene_of_the_file_is_named_as_it_or_its_variable_is(folder, name, rules, own):
    request = Request((f"both.py:{name}",))
    assert [r.name for r in request.rules()] == rules
    assert [s.name for s in request._objects(())[0]] == own


@pytest.mark.slow
def test_a_good_rule_passes_with_a_line_a_verdict_and_a_table(folder, ask):
    code, out, err = ask("verify", "both.py", "--scene", "both.py:my-pendulum",
                         "--scene", "kepler", *QUICK, "--json", "found.json")  # fmt: skip
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("✓ symplecticity: my-pendulum, two-thirds, 50 digits: ")
    assert lines[1].startswith("✓ order: my-pendulum, two-thirds, 50 digits: 2.000")
    assert "verify: pass" in out and "All 4 cases pass." in lines[-1]
    assert (
        "two-thirds: self-adjoint (a step back undoes a step) on my-pendulum, kepler." in lines[-3]
    )
    assert lines[-2].endswith("of its size beside it: a fault farther away is not seen.")
    found = json.loads((folder / "found.json").read_text())
    assert found["study"] == "verify" and found["verdict"] == "pass"
    assert [s["self_adjoint"] for s in found["schemes"]] == [True, True]
    assert {(c["study"], c["scene"]) for c in found["cases"]} == {
        (study, scene)
        for study in ("order", "symplecticity")
        for scene in ("my-pendulum", "kepler")
    }
    assert found["cases"][0]["command"] == (
        "discmech order both.py:my-pendulum --rule both.py:two-thirds --digits 50"
    )
    assert found["command"].startswith("discmech verify both.py --scene")


def test_a_proof_for_every_lagrangian_stands_beside_the_verdicts(folder, monkeypatch):
    """That of a wrong point is a disproof, and of a program there is none.

    Asked for are the classes that are soon proven.
    """
    some = partial(verifying.prove, groupoid=("separable", "time", "lie_group"))
    monkeypatch.setattr(verifying, "prove", some)
    (folder / "wrong.py").write_text(
        "from discmech import black_box, discretisation\n"
        "@discretisation(order=2)\n"
        "def beside(L, G, x, u, h): return h * L(G.target(x, u, h * 51 / 100), u)\n"
        "@black_box(order=1)\n"
        "def program(q, p, h, scene): return q + h * p, p\n"
    )
    asked = Request(("both.py:two-thirds", "wrong.py")).rules()
    proofs = verifying.proofs_of(asked, verifying.silent)
    assert [p["verdict"] for p in proofs] == ["proven", "disproven"]
    assert [p["command"] for p in proofs] == ["discmech prove both.py:two-thirds",
                                              "discmech prove wrong.py:beside"]  # fmt: skip
    right, wrong = verdicts.proofs(StudyResult(proofs=proofs))
    assert right == ("two-thirds: order 2 is proven for every Lagrangian of 7 classes; the form "
                     "is proven by a theorem, as it has a discrete Lagrangian (nonholonomic "
                     "scenes have no form), for all of them "
                     "(discmech prove both.py:two-thirds).")  # fmt: skip
    said = "proven for every Lagrangian of 4 classes; disproven for T(v) − V(x), n = 2 (h^2 "
    assert wrong.startswith(f"beside: order 2 is {said}")
    assert "2 classes more: a scene that shows it is an exception" in wrong
    assert "proven for every Lagrangian of 4 classes" in wrong


def test_proofs_are_kept_class_by_class_and_not_of_rules_that_may_read_anything(
    folder, monkeypatch
):
    """An interrupted run goes on with the classes that it has, and the next one asks nothing."""
    monkeypatch.setenv("DISCMECH_CACHE", str(folder / "cache"))
    monkeypatch.setattr(verifying, "prove", partial(verifying.prove, groupoid="separable"))
    (folder / "hidden.py").write_text(
        "import random\n"
        "from discmech import discretisation\n"
        "@discretisation(order=2)\n"
        "def chance(L, G, x, u, h):\n"
        "    random.random()\n"
        "    return h * L(G.target(x, u, h / 2), u)\n"
    )
    asked = Request(("both.py:two-thirds",)).rules()
    labels = []

    def stopped(label, share):
        labels.append(label)
        if len(labels) == 2:
            raise KeyboardInterrupt

    def classes_asked(rules, progress=verifying.silent):
        before = len(made)
        proofs = verifying.proofs_of(rules, progress, Store())
        return len(made) - before, proofs

    made, answer = [], proving._answer
    monkeypatch.setattr(proving, "_answer", lambda *a: made.append(a) or answer(*a))
    with pytest.raises(KeyboardInterrupt):
        classes_asked(asked, stopped)
    assert len(made) == 1 and labels[0] == "two-thirds: proving, v·Mv/2 − V(x), n = 2"
    count, proofs = classes_asked(asked)
    assert count == 1 and len(proofs[0]["classes"]) == 2
    assert classes_asked(asked) == (0, proofs)
    opaque = Request(("hidden.py",)).rules()
    assert [classes_asked(opaque)[0] for _ in range(2)] == [2, 2]


def test_a_proof_ends_with_its_budget_and_names_what_it_did_not_reach(folder, monkeypatch):
    monkeypatch.setattr(verifying, "BUDGET", 0)
    proofs = verifying.proofs_of(Request(("both.py:two-thirds",)).rules(), verifying.silent)
    (said,) = verdicts.proofs(StudyResult(proofs=proofs))
    assert said.startswith("two-thirds: order 2 is not asked of L(x, v), n = 1 and ")
    assert said.endswith("within 0 s (discmech prove both.py:two-thirds).")


def test_proofs_of_compositions_of_one_name_are_told_apart():
    """Also of rules that the bench itself defines, with coefficients of one's own."""

    def with_first(a):
        return rules.compose(rules.get("midpoint"), [a, 1 - 2 * a, a], name="own")

    keys = {of_proof(with_first(Fraction(a, 10))) for a in (3, 4, 3)}
    assert len(keys) == 2


def test_what_is_left_out_is_named_with_the_reason(folder):
    request = Request(files=("both.py",), scenes=("both.py:my-pendulum", "kepler"))
    places = (("order", "kepler"), ("order", "my-pendulum"), ("momentum", "kepler"))
    cases = [Result(study, scene) for study, scene in places]
    asked = [get("order"), get("momentum")]
    why, unasked = verifying._left_out(request, request.choice(), asked, cases)
    assert "momentum on my-pendulum: it needs a scene that declares" in why and "order" not in why
    assert "work-precision" in unasked and "--study" in unasked and "lattices" not in unasked


def test_a_scene_that_one_study_alone_judges_is_left_out_by_no_other_s_needs(folder):
    request = Request(files=("both.py",), scenes=("kepler", "bouncing-ball"))
    asked = [get("symplecticity"), get("contact")]
    cases = [Result("symplecticity", "kepler"), Result("contact", "bouncing-ball")]
    apart, why, _ = verifying._left_out(request, request.choice(), asked, cases)
    assert apart.startswith("bouncing-ball has contact") and "symplecticity" not in why
    assert "contact on kepler: it needs" in why


def test_a_wrong_rule_fails_with_one_sentence_that_names_the_cause(folder, ask):
    code, out, _ = ask("verify", "wrong.py", "--scene", "kepler", *QUICK)
    assert code == 1 and "verify: fail" in out
    assert out.count("Cause: ") == 1  # a line says that it failed, the paragraph at the end why
    told = out[out.index("verify: fail") :]
    assert told.count("✗ order: kepler, a-third, 50 digits: order 1.0") == 1
    assert "Cause: gauge" in told
    assert "again: discmech order kepler --rule wrong.py:a-third --digits 50" in told
    assert "✗ symplecticity" not in told  # every discrete Lagrangian gives a symplectic map
    assert "a-third: not self-adjoint on kepler." in told


def test_json_on_standard_output_is_all_that_is_there(folder, ask):
    code, out, _ = ask("verify", "good.py", "--scene", "kepler", "--study", "order",
                       "--digits", "50", "--json", "-")  # fmt: skip
    assert code == 0 and json.loads(out)["cases"]


@pytest.mark.slow
def test_what_an_earlier_run_measured_of_a_rule_of_one_s_own_is_counted(folder, ask):
    words = ("verify", "good.py", "--scene", "harmonic", *QUICK, "--json", "found.json")
    counts = []
    for _ in range(2):
        ask(*words)
        found = json.loads((folder / "found.json").read_text())
        assert not any("remembered" in case for case in found["cases"])
        counts.append((found["remembered"], len(found["cases"])))
    (first, cases), (again, same) = counts
    assert first == 0 < cases == same == again


def test_the_page_stands_alone(folder, ask):
    quick = ("--study", "order", "--digits", "50")
    words = ("verify", "wrong.py", "--scene", "kepler", *quick, "--html", "found.html")
    assert ask(*words, "--jobs", "1")[0] == 1
    page = (folder / "found.html").read_text()
    assert "Overview" in page and "Cause: gauge" in page and "<svg" in page
    command = " ".join(("discmech", "verify", "wrong.py", "--scene", "kepler", *quick))
    assert f"{command} --html found.html" in page and "<h1>wrong.py verified</h1>" in page
    assert 'aria-label="discrete Lagrangian of a-third"><math' in page and '"words">Words' in page
    assert page.count("Cause: gauge") == 1
    assert 'href="tables/' not in page and 'href="figures/' not in page
    assert not [p for p in folder.iterdir() if p.name in ("figures", "tables", "equations")]


def test_a_rule_that_some_scene_cannot_use_is_inconclusive_there(folder, ask):
    (folder / "base.py").write_text(
        RULE.replace("return h", "return 0 * h * x[0] + h")  # a group has no x
    )
    words = ("verify", "base.py", "--scene", "kepler", "--scene", "rigid-body", "--study", "order",
             "--digits", "50", "--jobs", "1")  # fmt: skip
    code, out, _ = ask(*words, "--study", "symplecticity", "--steps", "16")
    assert code == 3 and "✓ order: kepler" in out
    # once for both, under the table
    assert "? order: rigid-body, two-thirds, cayley, 50 digits: base.py, line 8: rigid-body" in out
    assert out.count("base.py, line 8") == 1 and "and so 1 more of symplecticity" in out
    code, out, err = ask(*words[:2], *words[4:])  # nothing else: bad input
    assert code == 2 and out.count("\n") <= 1 and "base.py, line 8" in err


@pytest.mark.slow
def test_a_bad_rule_beside_others_is_bad_input_unless_one_of_them_fails(folder, ask):
    text = RULE + RULE.replace("two_thirds", "broken").replace("return h", "return h * nothing")
    (folder / "several.py").write_text(text)
    code, out, err = ask("verify", "several.py", "--scene", "kepler", *QUICK)
    assert code == 2 and "✓ order: kepler, two-thirds" in out
    said = "several.py, line 16: kepler: rule broken could not be evaluated"
    assert out.count(said) == 1 and err.startswith("discmech: nothing could be measured of broken,")
    (folder / "several.py").write_text(text.replace("order=2", "order=4", 1))
    code, _, err = ask("verify", "several.py", "--scene", "kepler", *QUICK)
    assert (code, err) == (1, "")


@pytest.mark.slow
def test_a_rule_without_machine_code_is_bad_input_to_verify_as_to_run(folder, ask):
    """At the edges of a scene too: that it is refused there says nothing of the edge."""
    text = RULE.replace("return h", "return sympy.gamma(x[0]) * h").replace(
        "from", "import sympy\nfrom", 1
    )
    (folder / "complex.py").write_text(text)
    said = "kepler with two-thirds: the function "
    for words in (("verify", "complex.py", "--scene", "kepler", "--digits", "16"),
                  ("run", "kepler", "--rule", "complex.py")):  # fmt: skip
        code, _, err = ask(*words)
        assert code == 2 and "complex.py, line" in err and said in err


def test_a_claim_that_no_scene_can_judge_is_told(folder):
    claimed = "from discmech import black_box\n\n\n@black_box(keeps={!r})\ndef still(q, p, h):\n"
    claimed += "    return q, p\n"
    (folder / "slip.py").write_text(claimed.format("enregy"))
    with pytest.raises(BadInput, match="'enregy', which no scene here has: did you mean 'energy'"):
        verify(Request(files=("slip.py",), scenes=("pendulum",)))
    (folder / "other.py").write_text(claimed.format("my charge"))
    choice = Request(files=("other.py",), scenes=("pendulum",)).choice()
    assert "not judged" in verifying._names_of_nothing(choice)[0]
    (folder / "bare.py").write_text(
        claimed.format("momentum") + "\n\nfrom discmech import Scene, pair\n"
        "bare = Scene('bare', pair(1), lambda x, v, p: v[0] ** 2 / 2, x0=[0], v0=[1])\n"
    )
    told = verifying._names_of_nothing(
        Request(files=("bare.py",), scenes=("bare.py:bare",)).choice()
    )
    assert len(told) == 1 and "claims to keep momentum, and no scene" in told[0]


CLAIMS = """from discmech import Conserved, Scene, one_step, pair


@one_step(order=2, implicit=True, reversible=True, symplectic=True, keeps="momentum")
def claimed(s, z, Z, h):
    return Z - z - h * s.f((z + Z) / 2)


rubbed = Scene(
    "rubbed", pair(2), lambda x, v, p: v.dot(v) / 2 - x.dot(x) / 2, x0=[1, 0], v0=[0, 1],
    force=lambda x, v, p: [-v[0] / 9, -v[1] / 8], duration=2, step="1/20",
    symmetries=[Conserved("turns", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])],
)
"""


def test_what_no_case_judges_is_told_with_the_reason(folder):
    """A form under a force, and what the force changes of a momentum by a map without its work."""
    (folder / "claims.py").write_text(CLAIMS)
    choice = Request(files=("claims.py",), scenes=("claims.py:rubbed",)).choice()
    judges = [get(name) for name in (*verifying.studies(), "reversibility")]
    done = [Result(study=study.name, scene=case.scene.name, rule=case.rule.name)
            for study in judges for case in study.cases(choice)]  # fmt: skip
    form, momentum = verifying.unjudged(choice, judges, done)
    assert form.startswith("claimed claims to be symplectic, which nothing judges here (sympl")
    assert momentum.startswith("rubbed declares turns, which nothing judges by claimed (momentum:")
    assert not verifying.momenta_of(choice, done, claimed=False)
    silent = replace(choice, rules=tuple(replace(rule, claims=None) for rule in choice.rules))
    assert [verifying.momenta_of(silent, done, claimed=c) for c in (True, False)] == [
        [],
        [momentum],
    ]
    all_of_them = verifying.unjudged(choice, judges, [])
    assert [said for said in all_of_them if "reversible" in said and "contact" in said]


def test_of_each_scene_alone_all_claims_of_the_built_in_rules_are_judged():
    every, judges = Choice(), [get(name) for name in verifying.studies()]
    ones = [replace(every, scenes=(scene,), rules=(rule,)) for scene, rule in every.pairs()]
    varied = vary(rules.get("midpoint"), lambda x, mu, p: 1 + mu.dot(mu), "poincare", name="varied")
    ones.append(replace(every, scenes=(scenes.get("pendulum"),), rules=(varied,)))
    for one in ones:
        done = [Result(study=study.name, scene=case.scene.name, rule=case.rule.name)
                for study in judges for case in study.cases(one)]  # fmt: skip
        assert not verifying.unjudged(one, judges, done)


@pytest.mark.slow
def test_a_claim_that_no_case_judges_is_no_pass(folder, ask):
    (folder / "claims.py").write_text(CLAIMS)
    asked = ("--scene", "claims.py:rubbed", "--steps", "100", "--digits", "16")
    code, out, _ = ask("verify", "claims.py", *asked)
    assert code == 3 and "symplectic, which nothing judges" in " ".join(out.split())


def test_a_scene_that_no_study_can_use_is_bad_input_and_not_inconclusive(folder, ask):
    (folder / "flat.py").write_text(SCENE.replace("v[0] ** 2 / 2", "v[0]"))
    code, out, err = ask("verify", "flat.py", *QUICK)
    assert code == 2 and "my-pendulum with midpoint: " in err and "kinetic energy" in err


@pytest.mark.slow
def test_an_interrupted_run_goes_on_where_it_stopped(folder, ask, monkeypatch):
    from discmech.studies import get

    monkeypatch.setenv("DISCMECH_CACHE", str(folder))
    words = ("verify", "good.py", "--scene", "kepler", *QUICK)
    sound = get("order").measuring.measure

    def interrupted(case, progress):
        raise KeyboardInterrupt

    monkeypatch.setattr(get("order").measuring, "measure", interrupted)
    code, out, err = ask(*words)
    assert code == 130 and "goes on where it stopped" in err and "✓ symplecticity" in out
    assert (
        "cases are judged" in out
        and "are not: " in out
        and " of order." in out
        and "verify: inconclusive" in out
    )
    assert "kepler" in out.split("verify: ")[1]
    monkeypatch.setattr(get("order").measuring, "measure", sound)
    monkeypatch.setattr(
        get("symplecticity").measuring, "measure", interrupted
    )  # it is not measured again
    code, out, err = ask(*words)
    assert code == 0 and "✓ symplecticity" in out and "✓ order" in out


@pytest.mark.parametrize(("words", "message"), [
    (["not_there.py"], "not_there.py cannot be read"),
    (["midpont"], "did you mean midpoint"),
    (["own_study.py"], "own_study.py defines no rule or scene."),
    (["good.py", "--scene", "keplr"], "did you mean kepler"),
    (["good.py", "--digits", "5"], "--digits is 5"),
    (["good.py", "--html", "-"], "--html needs"),
    (["good.py", "--json", "good.py/found.json"], "cannot be written"),
    (["good.py", "--study", "momentum", "--scene", "both.py:my-pendulum"], "no study applies"),
    (["box.py", "--study", "extremes", "--scene", "pendulum"], "step is a program, and the study"),
])  # fmt: skip
def test_bad_input_has_a_sentence_and_exit_code_2(folder, ask, words, message):
    ask("new", "study", "own-study")  # a file without a rule
    box = "from discmech import black_box\n\n@black_box()\ndef step(q, p, h):\n    return q, p\n"
    (folder / "box.py").write_text(box)
    code, out, err = ask("verify", *words)
    assert code == 2 and out == "" and message in err and err.count("\n") == 1


def test_a_student_s_file_that_cannot_be_used_keeps_nobody_else_from_a_grade(folder, ask):
    """For each way in which a file gives nothing, and whatever becomes of the others."""
    broken = {
        "dan.py, line 1: expected ':'": ("dan", "def step(q, p, h, system)\n    return q, p\n"),
        "fay.py defines no rule and no scene": ("fay", "def step(q, p, h):\n    return q\n"),
        "kim.py, line 1: ModuleNotFoundError": ("kim", "import not_there\n"),
    }
    for name, text in broken.values():
        (folder / f"{name}.py").write_text(text)
    files = ["dan.py", "fay.py", "good.py", "kim.py"]
    only = ("--scene", "harmonic", "--study", "order", "--digits", "50", "--jobs", "1")
    code, out, err = ask("verify", *files, *only, "--json", "grades.json")
    grades = json.loads((folder / "grades.json").read_text())
    assert code == 2 and [case["rule"] for case in grades["cases"]] == ["two-thirds"]
    assert "✓ order: harmonic, two-thirds" in out and err.count("\n") == 3
    assert "case passes; not all that the files define could be judged." in out
    assert all(each in err and each in " ".join(grades["notes"]) for each in broken)
    assert ask("verify", *files, "wrong.py", *only)[0] == 1  # a failure is the worse
    code, out, err = ask("compare", *files, "midpoint", *only)
    assert code == 2 and "midpoint" in out and all(each in err for each in broken)
    code, out, err = ask("order", "harmonic", "--rule", "good.py", "--rule", "dan.py", *only[4:6])
    assert code == 2 and "two-thirds" in out and "dan.py, line 1" in err
    # the whole is no pass, and no baseline is made of it
    assert (grades["verdict"], grades["cases"][0]["verdict"]) == ("inconclusive", "pass")
    kept = ("--badge", "b.svg", "--save-baseline", "class")
    for words in (["verify", *files, *only, *kept],
                  ["order", "harmonic", "--rule", "good.py", "--rule", "dan.py", *only[4:6],
                   *kept[2:]]):  # fmt: skip
        code, out, err = ask(*words)
        assert code == 2 and "not saved as the baseline class" in out
    assert "inconclusive (1 pass)" in (folder / "b.svg").read_text("utf-8")
    # nothing is measured if none is left, or a file is not there
    code, out, err = ask("verify", "dan.py", "fay.py", *only)
    assert code == 2 and not out and "dan.py, line 1" in err and "fay.py defines" in err
    code, out, err = ask("verify", "good.py", "lee.py", *only)
    assert code == 2 and not out and "lee.py cannot be read" in err


def test_no_other_rules_are_judged_in_place_of_one_that_could_not_be_made(folder, ask):
    """A build that failed leaves a scene alone, and no green badge."""
    program = "from discmech import external\n\nmine = external(['./not-built'], order=2)\n"
    (folder / "built.py").write_text(program + SCENE)
    kept = ("--json", "b.json", "--badge", "b.svg", "--save-baseline", "built")
    for words in (["verify", "built.py", *kept], ["order", "harmonic", "--rule", "built.py"]):
        code, out, err = ask(*words)
        assert code == 2 and not out and "built.py, line 3: there is no program" in err
    assert not (folder / "b.json").exists()
    assert "inconclusive (no case)" in (folder / "b.svg").read_text("utf-8")


def test_verdicts_are_told_while_others_are_measured(folder, monkeypatch):
    told = []
    request = Request(files=("good.py",), scenes=("kepler",), digits=(50,), studies=("order",))
    result = verify(request, told=lambda case: told.append((case.study, case.scene)), jobs=1)
    assert told == [("order", "kepler")] and result.verdict == "pass"
    monkeypatch.setattr(verifying, "run_studies", lambda *a, **k: pytest.fail("it ran"))
    with pytest.raises(BadInput, match="no study applies"):
        verify(Request(files=("both.py",), scenes=("both.py:my-pendulum",), studies=("momentum",)))


def test_a_method_that_leaves_the_unit_circle_has_no_stable_step():
    measured = {"stable_to": None, "off_circle": 0.02}
    case = result_of("stability", {"kind": "linear", "measured": measured})
    assert STABILITY.compared(case) == {} and STABILITY.short(case) == "not on the unit circle"
    measured = {"stable_to": 2.0, "off_circle": None}
    case = result_of("stability", {"kind": "linear", "measured": measured})
    assert STABILITY.compared(case) == {"stable": 2.0}


def test_a_line_of_what_failed_says_why_once():
    case = Result(
        "energy", "kepler", "mine", verdict="fail", wanted={"slope_limit": 1e-9},
        reason="the energy drifts. Cause: rule: it is wrong.",
        figures={"band": 1e-3, "slope": 1e-5},
    )  # fmt: skip
    said = verdicts.line(case)
    assert said.startswith("✗ energy: kepler, mine") and said.endswith(": the energy drifts.")
    assert "drifts" not in verdicts.line(case, [case.reason])
    sure = replace(case, verdict="pass", reason="the form is kept in runs of up to 512 steps.")
    assert verdicts.line(sure).endswith(sure.reason)  # how far a pass reaches
    screen = Console(file=io.StringIO(), width=100)
    print_result(screen, StudyResult(study="energy", verdict="pass", cases=[sure]))
    assert f"pass: kepler, mine, 16 digits: {sure.reason}" in screen.file.getvalue()


def test_a_rule_for_pairs_alone_is_tried_on_six_scenes_of_these():
    def names(words, together=False):
        return [s.name for s in usual_scenes(lookup.rules(words), together)]

    assert names(["midpoint"]) == names(["midpoint", "gauss-2"], together=True) == list(SCENES)
    assert names(["stoermer-verlet"]) == list(ON_PAIRS)
    assert len(ON_PAIRS) == 6 and {scenes.get(n).groupoid.kind for n in ON_PAIRS} == {"pair"}
    assert {*names(["stoermer-verlet", "midpoint"])} == {*SCENES, *ON_PAIRS}
    assert names(["stoermer-verlet", "midpoint"], together=True) == list(ON_PAIRS)
