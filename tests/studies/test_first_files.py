"""What `discmech new` writes works as it is, and `discmech explain` says what was derived."""

import json
import re

import pytest
from sympy import Matrix

from discmech.integrators import BadInput, Scene, Scheme, pair, rules, scenes
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.numbers import first_violation
from discmech.integrators.rules import midpoint
from discmech.studies import explain
from discmech.studies.command.entry import main
from discmech.studies.command.equations import letters_of, plain_text, written
from tests.studies.test_ordinary_scenes import dense_chain


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rule", "scene", "groupoid"])
def test_a_new_file_passes_as_it_is(kind, here, capsys):
    assert main(["new", kind, "my-own"]) == 0
    assert "discmech verify my_own.py" in capsys.readouterr().out
    text = (here / "my_own.py").read_text(encoding="utf-8")
    assert "discmech verify my_own.py" in text and "starter" not in text and "FILE" not in text
    asked = ["--study", "order", "--study", "symplecticity", "--digits", "50", "--json", "-"]
    where = ["--scene", "harmonic"] if kind == "rule" else []
    assert main(["verify", "my_own.py", *where, *asked]) == 0
    cases = json.loads(capsys.readouterr().out)["cases"]
    assert len(cases) >= 2 and all("my-own" in (c["scene"], c["rule"]) for c in cases)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rule", "scene", "groupoid"])
def test_a_new_file_passes_every_study(kind, here, capsys):
    assert main(["new", kind, "my-own"]) == 0
    assert main(["verify", "my_own.py"]) == 0, capsys.readouterr().out


def test_nothing_is_overwritten_and_names_are_checked(here, capsys):
    (here / "mine.py").write_text("kept")
    for words, said in (
        (["rule", "mine"], "mine.py is there already"),
        (["rule", "3 rules"], "the name is '3 rules'"),
        (["rule", "midpoint"], "midpoint is discmech's own"),
        (["scene", "kepler"], "kepler is discmech's own"),
        (["rule", "lambda"], "lambda.py would hide a module"),
        (["scene", "sympy"], "sympy.py would hide a module"),
        (["scene", "other", "--folder", "nowhere"], "there is no folder nowhere"),
    ):
        assert main(["new", *words]) == 2
        assert said in capsys.readouterr().err
    assert (here / "mine.py").read_text() == "kept" and not list(here.rglob("other*"))


QUICK = ("pendulum", "rigid-body", "heavy-top", "kepler", "moser-veselov", "suslov")


@pytest.mark.dear("top]")
@pytest.mark.parametrize(
    "scene", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
              for name in scenes.every_name() if scenes.get(name).has_lagrangian],
)  # fmt: skip
def test_the_equations_that_are_written_out_are_those_that_are_solved(scene):
    scheme = Scheme(scenes.get(scene), midpoint)
    out, s, maps = written(scheme), scheme.s, scheme.discrete
    points = {z for p in maps.of.points for z in p.letters}
    said = {*out.letters, s.h}  # the page says what every letter is
    sides = [side for pair in (*out.momenta, *out.residual) for side in pair]
    for terms in (*sides, out.discrete_lagrangian, *out.force, *(b for _, b in out.points)):
        assert not {e for term in terms for e in term.free_symbols} - said
    if scheme.scene.all_constraints:
        return
    for column, derived in (([e for _, e in out.momenta], maps.minus),
                            ([e for e, _ in out.residual], maps.plus)):  # fmt: skip
        wanted = maps.of.graph.written_out(derived, points).xreplace(s.identity_translate) / s.h
        found = Matrix([sum(terms).subs(dict(out.shared)) for terms in column])
        assert first_violation(found - wanted, [s.h, *s.u, *points]) is None


def test_explain_says_order_symmetry_and_cost(capsys):
    assert main(["explain", "pendulum", "rectangle"]) == 0
    shown = capsys.readouterr().out
    for words in (
        "pendulum by rectangle", "l(x, u) = length²·mass·u²/2 + gravity·length·mass·cos(x)",
        "y = x + h·u", "order          1", "not self-adjoint", "one linear solve", "operations",
        "no Newton iteration where the equations of a step are affine in u",
    ):  # fmt: skip
        assert words in shown
    assert max(map(len, shown.splitlines())) <= 100
    assert "retraction" not in shown and "retraction cayley" in explain("rigid-body", midpoint)


@pytest.mark.slow
def test_of_many_equations_some_stand_for_all():
    page = explain(dense_chain(12), midpoint)
    assert page.count("… and so on; discmech report") == 3 and len(page.splitlines()) < 60
    assert "… and" not in explain("fpu", midpoint)


@pytest.mark.slow
def test_python_is_given_the_page_that_the_command_prints(capsys):
    assert main(["explain", "pendulum", "midpoint"]) == 0
    printed, given = capsys.readouterr().out, explain(scenes.get("pendulum"), midpoint)
    untimed = [[line for line in page.splitlines() if "cost" not in line]
               for page in (printed, given)]  # fmt: skip
    assert untimed[0] == untimed[1] and given.endswith("\n")
    with pytest.raises(BadInput, match="fput is a lattice"):
        explain(systems.get("fput"), midpoint)
    with pytest.raises(BadInput, match="no scene"):
        explain("pendulums", midpoint)


def test_explain_says_what_acts_and_what_holds(capsys):
    shown = {}
    for scene, rule in (("duffing", "midpoint"), ("cartesian-pendulum", "midpoint"),
                        ("pendulum", "runge-kutta-4")):  # fmt: skip
        assert main(["explain", scene, rule]) == 0
        shown[scene] = capsys.readouterr().out
    assert "f = −friction·u + drive·cos(frequency·t)" in shown["duffing"]
    assert "0 = −length²/2 + x₁²/2 + x₂²/2" in shown["cartesian-pendulum"]
    assert "μ₁ + h·x₁·λ/2 = mass·u₁" in shown["cartesian-pendulum"]
    assert "the map is explicit" in shown["pendulum"] and "solve" not in shown["pendulum"]


@pytest.mark.slow
def test_a_rule_with_stages_is_explained_in_letters_that_are_said():
    """As the sum that its author wrote, in x, u and s, without what kernels name by themselves."""
    shown = " ".join(explain("pendulum", rules.get("lobatto-3")).split())
    assert "s is the internal stage, 1 unknown: ∂L_d/∂s = 0" in shown
    assert "+ 2·h·l(b(x, −h·s/4 + h·u/2), u)/3" in shown
    said = shown.partition("Discrete Lagrangian")[2].partition("Method")[0]
    assert not re.search(r"[a-z]\d", said), "a letter of the kernels"
    out = written(Scheme(scenes.get("duffing"), midpoint))
    assert {"t", "t′", "t_z"} <= set(out.letters.values()) and "x_2" not in out.letters.values()


def test_a_parameter_has_its_own_name_unless_the_page_has_it():
    scene = Scene(
        name="swing", groupoid=pair(1), parameters={"g": 1, "h": 2}, x0=[1], v0=[0],
        lagrangian=lambda x, v, p: v[0] ** 2 / 2 - p.g * p.h * x[0] ** 2 / 2,
    )  # fmt: skip
    names = letters_of(Scheme(scene, midpoint)).values()
    assert {"g", "p.h"} <= set(names) and not {"p.g"} & set(names)


LONGER = ("gauss-2", "imex", "triple-jump:midpoint")


@pytest.mark.parametrize(
    "rule", ["own", *(pytest.param(rule, marks=pytest.mark.slow) for rule in LONGER)]
)
def test_every_kind_of_method_can_be_explained(rule):
    from discmech.studies.core import lookup

    scene = {"imex": "fpu", "own": "moser-veselov"}.get(rule, "heavy-top")
    lines = explain(scenes.get(scene), lookup.rule(rule)).splitlines()
    assert any(line.strip().startswith("order") for line in lines)
    assert max(map(len, lines)) <= 100


def test_terms_as_text():
    from sympy import Rational, Symbol, cos

    x, h = Symbol("x_1"), Symbol("h")
    assert plain_text([x**2 / 2, -h * cos(x)], {x: "x_1"}) == "x₁²/2 − h·cos(x₁)"
    assert plain_text([x ** Rational(-3, 2)], {x: "x_1"}) == "x₁^(−3/2)"
    assert plain_text([], {}) == "0"
