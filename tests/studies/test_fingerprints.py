"""Each thing that a result depends on changes its fingerprint, and nothing else does."""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from discmech.integrators import scenes
from discmech.integrators.lattices import systems
from discmech.integrators.rules import (
    METHODS,
    compose,
    dual_gauss,
    gauss,
    imex,
    midpoint,
    own,
    rectangle,
    trapezoidal,
)
from discmech.studies import NAMES, get
from discmech.studies.core import fingerprint, lookup
from discmech.studies.core.case import Case, Choice
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


def test_retractions_have_their_own():
    body = scenes.get("rigid-body")
    from discmech.integrators import exponential

    assert key(scene=body) != key(scene=body.with_retraction(exponential))


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A copy of our text that may be changed; fingerprints are of it."""
    for name in ("integrators", "reference", "studies", "tests/bench"):
        shutil.copytree(fingerprint.ROOT / name, tmp_path / "tree" / name,
                        ignore=shutil.ignore_patterns("__pycache__"))  # fmt: skip
    here = Path(fingerprint.ROOT)
    monkeypatch.setattr(fingerprint, "ROOT", tmp_path / "tree")
    for module in (*(get(name).measuring for name in NAMES), power):
        moved = tmp_path / "tree" / Path(module.__file__).relative_to(here)
        monkeypatch.setattr(module, "__file__", str(moved))

    def forget():
        for function in (fingerprint.text_of, fingerprint._text_of_scene, fingerprint._text_of_all,
                         fingerprint._text_of_rule, fingerprint._imports):  # fmt: skip
            function.cache_clear()

    forget()
    yield tmp_path / "tree", forget
    forget()


def append(file):
    file.write_text(file.read_text() + "\n# changed\n")


TEXT_OF_IT = (
    "integrators/flows/flow.py", "integrators/compiler/driver.py", "integrators/scene/scene.py",
    "integrators/rules/composition.py", "integrators/groupoids/pair.py",
    "reference/taylor/integration.py",
    "studies/order/measuring.py", "studies/core/fitting.py", "studies/core/side_by_side.py",
    "studies/core/fingerprint.py", "studies/causes/diagnosis.py",
    "integrators/scenes/kepler.py", "reference/tables/kepler.json",
)  # fmt: skip
OTHER_TEXT = (
    "integrators/scenes/pendulum.py", "reference/tables/pendulum.json",
    "studies/energy/measuring.py", "studies/report/tables.py", "studies/order/view.py",
    "studies/report/plot_convergence.py", "studies/plugin.py",
)  # fmt: skip


@pytest.mark.slow
def test_text_that_has_a_part_in_it_changes_it_and_no_other(checkout):
    tree, forget = checkout
    before = key()
    for file in OTHER_TEXT:
        append(tree / file)
    forget()
    assert key() == before
    for file in TEXT_OF_IT:
        everything = fingerprint.of_everything("power")
        append(tree / file)
        forget()
        assert key() != before and fingerprint.of_everything("power") != everything, file
        before = key()


ON_FPU = {"name": "stability", "scene": "fpu"}
ON_STICKS = {"name": "charts", "scene": "moser-veselov", "rule": own}
#: a rule of the bench: what rests on it
RESTS_ON = {
    "midpoint": (key, partial(key, rule=compose(midpoint, "suzuki")), partial(key, "savings")),
    "trapezoidal": (partial(key, rule=trapezoidal), partial(key, **ON_FPU, rule=imex)),
    "rectangle": (partial(key, rule=rectangle), partial(key, **ON_STICKS)),
    "imex": (partial(key, "order", "fpu", imex), partial(key, **ON_FPU, rule=imex)),
}  # fmt: skip


def keys_of_power(of=lambda case: case.fault.rule.rpartition(":")[2] if case.fault else (
    f"valid {', '.join(rule.name for rule in case.rules)}")):  # fmt: skip
    """By the rules that each fault or valid rule is run with, or what else is asked of a case."""
    asked = {of(case): case for case in power.cases(Choice(own=(("thorough", True),)))}
    return {name: fingerprint.of_case(POWER, case, False) for name, case in asked.items()}


def change_rule(tree, rule, text="    h = 2 * h / 2\n"):
    file = tree / "integrators/rules/simple.py"
    before, head, after = file.read_text().partition(f"def {rule}(")
    file.write_text(before + head + after.replace("    return h", f"{text}    return h", 1))


@pytest.mark.dear("[rectangle", "[midpoint", "[imex")
@pytest.mark.parametrize("rule", RESTS_ON)
def test_of_a_file_of_rules_only_those_that_changed_are_measured_again(checkout, rule):
    tree, forget = checkout
    before = {other: [ask() for ask in asked] for other, asked in RESTS_ON.items()}
    before_power = keys_of_power()
    assert {rule for rule in before_power if "valid" in rule} >= {"valid ", "valid midpoint"}
    change_rule(tree, rule)
    forget()
    for other, asked in RESTS_ON.items():
        changed = [ask() != earlier for ask, earlier in zip(asked, before[other], strict=True)]
        both = (rule, other) in {("trapezoidal", "imex"), ("imex", "trapezoidal")}  # imex on fpu
        assert changed == ([False, True] if both else [rule == other] * len(asked)), other
    for rules, earlier in keys_of_power().items():
        assert (earlier != before_power[rules]) == (rule in rules), rules


def test_comments_and_docstrings_of_rules_are_no_part(checkout):
    tree, forget = checkout
    before = key(), keys_of_power()
    change_rule(tree, "midpoint", "    # a comment\n")
    file = tree / "integrators/rules/simple.py"
    file.write_text(file.read_text().replace("at the middle of the step.", "halfway."))
    forget()
    assert (key(), keys_of_power()) == before


def test_what_a_rule_calls_in_its_file_is_a_part_of_it(checkout):
    tree, forget = checkout
    change_rule(tree, "trapezoidal", "    half = midpoint(L, G, x, u, h)\n")
    forget()
    before = key(rule=trapezoidal), key(rule=rectangle)
    change_rule(tree, "midpoint")
    forget()
    assert key(rule=trapezoidal) != before[0] and key(rule=rectangle) == before[1]


def test_rules_by_quadrature_rest_on_their_file_and_others_do_not(checkout):
    tree, forget = checkout
    of_it = [partial(key, rule=rule) for rule in (gauss(2), dual_gauss(2))]
    before, other = [ask() for ask in of_it], key()
    file = tree / "integrators/rules/galerkin.py"
    file.write_text(file.read_text().replace("(4 * degree + 2)", "(2 + 4 * degree)"))
    forget()
    assert all(ask() != earlier for ask, earlier in zip(of_it, before, strict=True))
    assert key() == other


@pytest.mark.slow
def test_a_fault_rests_on_its_scene_and_on_the_studies_that_look_for_it(checkout):
    tree, forget = checkout
    keys = partial(keys_of_power, lambda case: case.scene.name)
    before = keys()
    append(tree / "integrators/scenes/kepler.py")
    append(tree / "studies/contact/measuring.py")  # no study of those
    append(tree / "tests/bench/power/view.py")
    forget()
    after = keys()
    assert [scene for scene in before if after[scene] != before[scene]] == ["kepler"]
    for file in ("studies/momentum/measuring.py", "tests/bench/power/catalogue.py",
                 "studies/core/one_case.py", "integrators/flows/flow.py"):  # fmt: skip
        append(tree / file)
        forget()
        again = keys()
        assert all(again[scene] != after[scene] for scene in after), file
        after = again


def test_a_race_rests_on_the_rules_that_take_part(checkout):
    tree, forget = checkout
    races = {case.scene.name: case for case in get("work-precision").cases(Choice())}

    def keys():
        return {name: fingerprint.of_case(get("work-precision"), case, timed=True)
                for name, case in races.items()}  # fmt: skip

    before = keys()
    change_rule(tree, "imex")
    forget()
    after = keys()
    with_it = {name for name, case in races.items() if imex in case.rules}
    assert {name for name in races if after[name] != before[name]} == with_it < {*races}


def test_a_c_file_beside_a_study_counts(checkout):
    tree, forget = checkout
    ask = partial(key, "lattices", systems.get("toda"), trapezoidal)
    before = ask(), key()
    with (tree / "studies/lattices/lattice.c").open("a") as file:
        file.write("/* changed */\n")
    forget()
    assert ask() != before[0] and key() == before[1]


def test_a_scene_of_a_known_name_with_other_symmetries_is_not_the_bench_s():
    kepler = scenes.get("kepler")
    assert fingerprint.is_ours(kepler) and fingerprint.is_ours(kepler.with_values(v0=[0, 1]))
    other = kepler.with_values(symmetries=scenes.get("heavy-top").symmetries)
    assert not fingerprint.is_ours(other)


def test_a_scene_rests_on_the_scene_that_it_imports(checkout):
    tree, forget = checkout
    before = key(scene="lagrange-top")
    append(tree / "integrators/scenes/heavy_top.py")
    forget()
    assert key(scene="lagrange-top") != before


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
    """Its equations do, so it does not matter where a number comes from."""
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
        assert not fingerprint.known_by_text(case)
        found.append(fingerprint.of_case(get("order"), case, timed=False))
    assert len(set(found)) == 3


def test_coefficients_count_not_the_name_of_a_method():
    rule = compose(midpoint, "suzuki")
    other = replace(METHODS["triple-jump"], name="suzuki")
    assert key(rule=rule) != key(rule=replace(rule, method=other))
