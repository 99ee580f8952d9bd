"""Each thing that a result depends on changes its fingerprint, and nothing else does."""

import shutil
from dataclasses import replace
from functools import partial
from types import FunctionType

import pytest

from discmech.integrators import Scheme, scenes
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.rules import (
    BUILT_IN,
    METHODS,
    compose,
    discretisation,
    dual_gauss,
    gauss,
    imex,
    midpoint,
    rectangle,
    trapezoidal,
)
from discmech.studies import get
from discmech.studies.core import fingerprint, lookup
from discmech.studies.core.case import Case, Choice
from discmech.studies.evidence import evidence_of, own_rules
from discmech.tests.bench.power import STUDY as POWER
from discmech.tests.bench.power import measuring as power


def key(name="order", scene="kepler", rule=midpoint, digits=16, steps=None, timed=False, **more):
    scene = scenes.get(scene) if isinstance(scene, str) else scene
    return fingerprint.of_case(get(name), Case(name, scene, rule, digits, steps, **more), timed)


CHANGED = {
    "study": {"name": "energy"},
    "scene": {"scene": "pendulum"},
    "parameter": {"scene": scenes.get("kepler").with_values(parameters={"strength": 2})},
    "start": {"scene": scenes.get("kepler").with_values(x0=["1/2", 0])},
    "velocity": {"scene": scenes.get("kepler").with_values(v0=[0, 1])},
    "duration": {"scene": scenes.get("kepler").with_values(duration=7)},
    "step": {"scene": scenes.get("kepler").with_values(step="0.03125")},
    "rule": {"rule": trapezoidal},
    "number of nodes": {"rule": gauss(3)},
    "composition": {"rule": compose(midpoint, "suzuki")},
    "digits": {"digits": 50},
    "steps": {"steps": 12},
    "thorough": {"thorough": True},
    "control": {"control": "explicit Euler"},
    "machine of a time": {"timed": True},
}


def test_of_equal_questions_it_is_equal():
    assert key() == key() and len({key(), *(key(**c) for c in CHANGED.values())}) == 1 + len(
        CHANGED
    )


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A copy of our text that may be changed; keys are of it."""
    for name in ("integrators", "reference", "studies", "tests/bench"):
        shutil.copytree(fingerprint.ROOT / name, tmp_path / "tree" / name,
                        ignore=shutil.ignore_patterns("__pycache__"))  # fmt: skip
    moved = [tmp_path / "tree" / p.relative_to(fingerprint.ROOT) for p in fingerprint.STUDIES]
    monkeypatch.setattr(fingerprint, "STUDIES", tuple(moved))
    monkeypatch.setattr(fingerprint, "ROOT", tmp_path / "tree")
    yield tmp_path / "tree"
    forget()


def forget():
    for function in (fingerprint.text_of, fingerprint._text_of_scene, fingerprint._text_of_all,
                     fingerprint._text_of_rule, fingerprint._text_of_mathematics,
                     fingerprint._text_of_showing, fingerprint._text_of_search,
                     fingerprint._text_of_judges):  # fmt: skip
        function.cache_clear()


def changes(tree, file, ask):
    """Whether a change of the file changes what is asked."""
    forget()
    before = ask()
    with (tree / file).open("a") as text:
        text.write("\n# changed\n")
    forget()
    return ask() != before


@pytest.mark.dear(but=("studies/report/tables.py", "studies/core/one_case.py",
                       "studies/order/__init__.py", "studies/evidence/order.py",
                       "studies/evidence/judging.py", "studies/order/judging_steps.py",
                       "integrators/scenes/pendulum.py",
                       "studies/energy/judging_errors.py"))  # fmt: skip
@pytest.mark.parametrize(("file", "counts"), [
    ("integrators/flows/flow.py", True), ("integrators/compiler/driver.py", True),
    ("integrators/rules/composition.py", True), ("reference/taylor/series.py", True),
    ("studies/order/measuring.py", True), ("studies/order/window.py", True),
    ("studies/core/one_case.py", True), ("studies/evidence/order.py", True),
    ("studies/causes/round_off.py", True), ("studies/systems/scene_system.py", True),
    ("integrators/scenes/kepler.py", True), ("reference/tables/kepler.json", True),
    ("integrators/scenes/pendulum.py", False), ("reference/tables/pendulum.json", False),
    ("integrators/rules/trapezoidal.py", False), ("studies/energy/measuring.py", False),
    ("studies/order/judging.py", False), ("studies/order/judging_steps.py", False),
    ("studies/energy/judging_errors.py", False), ("studies/evidence/judging.py", False),
    ("studies/order/__init__.py", False), ("studies/order/view.py", False),
    ("studies/report/tables.py", False), ("studies/plugin.py", False),
])  # fmt: skip
def test_text_that_measures_counts_and_no_other(checkout, file, counts):
    assert changes(checkout, file, key) == counts


@pytest.mark.slow
def test_a_study_rests_on_those_that_it_imports_and_on_its_c_files(checkout):
    ask = partial(key, "lattices", systems.get("toda"), trapezoidal)
    assert changes(checkout, "studies/contact/measuring.py", ask)
    assert changes(checkout, "studies/lattices/lattice.c", ask)
    assert changes(checkout, "integrators/extensions/lattices/scenes/linkages.py", ask)
    assert not changes(checkout, "studies/stability/measuring.py", ask)
    assert not changes(checkout, "studies/lattices/lattice.c", key)


@pytest.mark.dear(but=("__init__",))
@pytest.mark.parametrize("name", ["__init__", "equations", "scipys"])
def test_a_race_rests_on_the_integrators_of_others(checkout, name):
    race = get("work-precision").cases(Choice((scenes.get("pendulum"),), (midpoint,)))[0]
    ask = partial(fingerprint.of_case, get("work-precision"), race, True)
    assert changes(checkout, f"studies/work_precision/peers/{name}.py", ask)


def test_measuring_asks_judges_for_decisions_alone():
    """They are kept and made again; the text of a judge that measuring asks for more counts."""
    for folder in fingerprint.STUDIES:
        for file in folder.glob("*/*.py"):
            if not any(map(file.match, (*fingerprint.NOT_MEASURING, "report/*"))):
                assert not [text for text in fingerprint._asked_by(file) if "Verdict" in text], file


def edited(tree, file, old, new, ask):
    """Whether a change of a part of a file changes what is asked."""
    forget()
    before, text = ask(), (tree / file).read_text()
    assert old in text
    (tree / file).write_text(text.replace(old, new))
    forget()
    after = ask()
    (tree / file).write_text(text)
    return after != before


@pytest.mark.dear(but=("is_wide", "CHANGES"))
@pytest.mark.parametrize(("study", "file", "old", "new", "counts"), [
    ("symplecticity", "symplecticity/limits.py", 'CHANGES = ("change", ', "CHANGES = (", True),
    ("symplecticity", "symplecticity/limits.py", "1e-13, ", "1e-12, ", False),
    ("contact", "contact/limits.py", "1.5, ", "2.5, ", False),
    ("contact", "contact/judging_rises.py", "10 * limit", "9 * limit", False),
    ("momentum", "momentum/limits.py", "5, ", "6, ", False),
    ("energy", "energy/limits.py", "0.1, ", "0.2, ", False),
    ("steps", "energy/judging_errors.py", "LIMITS[\"wide\"]", "1", False),
    ("steps", "energy/judging_errors.py", "@decision\ndef is_wide", "def is_wide", True),
])  # fmt: skip
def test_what_measuring_reads_of_judges_and_limits_counts(checkout, study, file, old, new, counts):
    scene = "kepler" if study != "contact" else "bouncing-ball"
    assert edited(checkout, f"studies/{file}", old, new, partial(key, study, scene)) == counts


def test_of_limits_what_measuring_names_counts(tmp_path):
    """A number without its reason, a function with what it reads; all if any may be read."""
    (tmp_path / "limits.py").write_text(
        "A = {'one': Limit(1, 'what', 'why'), 'two': Limit(2, 'what', 'why')}\n"
        "B = ('b',)\n\n\ndef most(n):\n    return A['two'] * n\n"
    )
    whole = (tmp_path / "limits.py").read_text()
    most = "def most(n):\n    return A['two'] * n"
    for text, read in (
        ("from .limits import A\nx = A['one']", ["A one 1"]),
        ("from .limits import A as C\nx = C['two'], C['one']", ["A one 1", "A two 2"]),
        ("from .limits import B\nx = B", ["B = ('b',)"]),
        ("def f():\n    from .limits import most\n    return most(1)", [most, "A two 2"]),
        ("from .limits import A\nx = A[n]", [whole]), ("from .limits import A\nx = {**A}", [whole]),
        ("from .limits import A\nx = A['three']", [whole]), ("from . import limits", [whole]),
        ("from .limits import A", [whole]), ("from .others import A\nx = A['one']", []),
    ):  # fmt: skip
        (tmp_path / "measuring.py").write_text(text)
        assert list(fingerprint._asked_by(tmp_path / "measuring.py")) == read


@pytest.mark.slow
def test_a_fault_rests_on_what_measures_in_the_studies_that_look_for_it(checkout):
    first = power.cases(Choice(own=(("only", "pendulum midpoint: rule, double"),)))[0]
    ask = partial(fingerprint.of_case, POWER, first, False)
    assert changes(checkout, "studies/momentum/measuring.py", ask)
    assert changes(checkout, "tests/bench/power/catalogue.py", ask)
    assert not changes(checkout, "studies/momentum/judging.py", ask)
    assert not changes(checkout, "studies/contact/measuring.py", ask)


@pytest.mark.parametrize("file", ["studies/order/judging.py", "reference/tables/kepler.json"])
def test_what_tests_the_bench_itself_rests_on_everything(checkout, file):
    assert changes(checkout, file, partial(fingerprint.of_everything, "power"))


@pytest.mark.dear(but=("energy/limits.py", "momentum/limits.py"))
@pytest.mark.parametrize(("file", "counts"), [
    ("studies/energy/limits.py", True), ("studies/order/limits.py", True),
    ("studies/evidence/judging.py", True), ("studies/causes/diagnosis.py", True),
    ("integrators/scenes/pendulum.py", True), ("reference/tables/kepler.json", True),
    ("studies/momentum/limits.py", False), ("studies/report/tables.py", False),
])  # fmt: skip
def test_the_search_for_a_cause_rests_on_all_that_its_study_may_judge(checkout, file, counts):
    assert changes(checkout, file, partial(fingerprint.of_search, get("energy"))) == counts


@pytest.mark.parametrize(("file", "counts"), [
    ("studies/proof/laws.py", True), ("studies/evidence/powers.py", True),
    ("integrators/rules/composition.py", True), ("integrators/rules/trapezoidal.py", False),
    ("integrators/scenes/pendulum.py", False),
    ("studies/momentum/limits.py", False), ("studies/energy/judging.py", False),
])  # fmt: skip
def test_a_proof_rests_on_all_that_proves(checkout, file, counts):
    assert changes(checkout, file, partial(fingerprint.of_proof, midpoint)) == counts


def altered(rule, **parts):
    """The rule with other parts of its formula's code, as if its file said so."""
    formula = FunctionType(rule.formula.__code__.replace(**parts), rule.formula.__globals__)
    return replace(rule, formula=formula)


@pytest.mark.parametrize("rule", [rectangle, midpoint, trapezoidal, imex], ids=lambda r: r.name)
def test_a_rule_rests_on_what_its_formula_does_and_not_on_the_words_for_it(rule):
    code = rule.formula.__code__
    names = tuple(f"{name}_" for name in code.co_varnames)
    said = ("other words", *code.co_consts[1:])
    assert key(rule=altered(rule, co_varnames=names, co_consts=said)) == key(rule=rule)
    different = [altered(rule, co_consts=(*code.co_consts[:-1], 3)),
                 altered(rule, co_code=trapezoidal.formula.__code__.co_code[:-2])]  # fmt: skip
    assert len({key(rule=each) for each in (rule, *different)}) == 3
    composed = {key(rule=compose(each, "suzuki")) for each in (rule, *different)}
    assert len(composed) == 3


def test_exact_steps_of_a_lattice_rest_on_no_rule_that_is_judged(monkeypatch):
    ask = partial(key, "lattices", systems.get("toda"), gauss(2))
    before = ask()
    other = altered(trapezoidal, co_consts=(*trapezoidal.formula.__code__.co_consts[:-1], 3))
    monkeypatch.setitem(BUILT_IN, "trapezoidal", other)
    exact = evidence_of(Scheme(systems.get("toda"), other)).exact.rule
    assert ask() == before and not any(map(fingerprint.is_ours, (exact, own_rules.WITNESS)))


@pytest.mark.slow
def test_rules_by_quadrature_rest_on_their_file_and_others_do_not(checkout):
    file = "integrators/rules/galerkin.py"
    for rule in (gauss(2), dual_gauss(2)):
        assert changes(checkout, file, partial(key, rule=rule))
    assert not changes(checkout, file, key)


def test_a_race_and_what_is_measured_beside_rest_on_the_rules_that_take_part():
    races = {case.scene.name: case for case in get("work-precision").cases(Choice())}
    assert imex in races["fpu"].race.rules and imex not in races["kepler"].race.rules
    assert get("charts").rules_beside(None) == [rectangle]


def test_a_scene_of_a_known_name_with_other_symmetries_is_not_the_bench_s():
    kepler = scenes.get("kepler")
    assert fingerprint.is_ours(kepler) and fingerprint.is_ours(kepler.with_values(v0=[0, 1]))
    other = kepler.with_values(symmetries=scenes.get("heavy-top").symmetries)
    assert not fingerprint.is_ours(other)


def test_a_scene_rests_on_the_scene_that_it_imports(checkout):
    ask = partial(key, scene="lagrange-top")
    assert changes(checkout, "integrators/scenes/heavy_top.py", ask)


def test_versions_count(monkeypatch):
    before = key()
    monkeypatch.setattr(fingerprint, "versions", lambda: {"sympy": "0.1"})
    assert key() != before


USER = """
from discmech import Scene, discretisation, pair
from numbers_beside import STRENGTH, KEPT
from discmech.integrators.scene import Conserved

@discretisation(order=2)
def mine(L, G, x, u, h):
    return h * (L(x, u) + STRENGTH * L(G.target(x, u, h), u)) / (1 + STRENGTH)

oscillator = Scene("oscillator", pair(1), lambda x, v, p: (v[0]**2 - STRENGTH * x[0]**2) / 2,
                   x0=[1], v0=[0], symmetries=[Conserved("J", lambda x, mu, p: KEPT * mu)])
"""


def test_what_a_users_file_imports_counts(tmp_path, monkeypatch):
    """It does not matter where a number comes from."""
    file = tmp_path / "mine.py"
    monkeypatch.syspath_prepend(str(tmp_path))
    found = []
    for number, beside in enumerate(("STRENGTH, KEPT = 1, 1", "STRENGTH, KEPT = 2, 1",
                                     "STRENGTH, KEPT = 1, 3")):  # fmt: skip
        (tmp_path / f"values_{number}.py").write_text(beside)
        text = USER.replace("numbers_beside", f"values_{number}")
        file.write_text(text)
        rule, scene = lookup.rule(f"{file}:mine"), lookup.scene(f"{file}:oscillator")
        case = Case("order", scene, rule, 16)
        found.append(fingerprint.of_case(get("order"), case, timed=False))
    assert len(set(found)) == 3


def test_a_rule_of_a_user_counts_by_its_formula():
    def points(share):
        of = discretisation(order=2, name="points")
        return of(lambda L, G, x, u, h: h * L(G.target(x, u, share * h), u))

    assert key(rule=points(1)) == key(rule=points(1)) != key(rule=points(0))


def test_coefficients_count_not_the_name_of_a_method():
    rule = compose(midpoint, "suzuki")
    other = replace(METHODS["triple-jump"], name="suzuki")
    assert key(rule=rule) != key(rule=replace(rule, method=other))
