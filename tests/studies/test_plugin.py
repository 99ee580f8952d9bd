"""The assertions and the pytest plugin, in a repository that has nothing but discmech."""

import importlib
import re
import tomllib
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from discmech.integrators import BadInput, Conserved, discretisation, scenes
from discmech.studies import every_study
from discmech.studies.core.study import view_of
from discmech.studies.symplecticity.view import NAMES
from discmech.studies.user import assertions
from discmech.studies.user.assertions import (
    Missed,
    assert_converges,
    assert_momentum,
    assert_order,
    assert_reversible,
)
from tests.imports import ROOT

pytest_plugins = ["pytester"]

RULE = """
from discmech.integrators import discretisation

@discretisation()
def two_thirds(L, G, x, u, h):
    return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2
"""


@discretisation()
def lopsided(L, G, x, u, h):
    """The Lagrangian at a third of the step: order 1, and not self-adjoint."""
    return h * L(G.target(x, u, h / 3), u)


def ask(pytester, test, *words):
    """Run a test file in an empty folder with the plugin, and with nothing of this repository."""
    pytester.makepyfile(my_rule=RULE)
    pytester.makepyfile(test)
    return pytester.runpytest_subprocess("-p", "no:discmech", "-p", "discmech.studies.plugin", "-p",
                                        "no:cacheprovider", *words, timeout=120)  # fmt: skip


@pytest.mark.slow
def test_a_sound_rule_passes_and_what_cannot_be_asserted_is_skipped_with_the_sentence(pytester):
    done = ask(pytester, """
        from my_rule import two_thirds

        def test_mine(assert_order, assert_symplectic, assert_reversible, assert_converges):
            assert_order("my_rule.py:two_thirds", "pendulum", 2, digits=16)
            assert_converges(two_thirds, "pendulum", digits=16)
            assert_symplectic(two_thirds, "pendulum", digits=16, steps=8)
            assert_reversible(two_thirds, "pendulum", digits=16)

        def test_momentum(assert_momentum):
            assert_momentum(two_thirds, "kepler", digits=16, steps=100)

        def test_stages(assert_order):
            assert_order("gauss-2", "cartesian-pendulum")

        def test_energy(assert_energy):
            assert_energy("midpoint", "suslov", steps=500)
    """, "-rs")  # fmt: skip
    done.assert_outcomes(passed=2, skipped=2)
    done.stdout.fnmatch_lines(["*gauss-2 has none: take a rule without stages*"])
    assert "energy of suslov: nonholonomic: measured only" in done.stdout.str()


@pytest.mark.slow
def test_a_failure_prints_the_table_and_attaches_the_picture(pytester):
    done = ask(pytester, """
        from my_rule import two_thirds

        def test_mine(assert_order):
            assert_order(two_thirds, "kepler", 4)
    """, "--junitxml=found.xml")  # fmt: skip
    done.assert_outcomes(failed=1)
    shown = done.stdout.str()
    assert "two-thirds" in shown and "4 ± 0.05" in shown and "below the expected 4" in shown
    assert "Cause: discrete Lagrangian" in shown
    assert "user/assertions.py" not in shown  # the traceback is the user's own
    assert "next: mend the rule" in shown and "if you mean order 2, ask for order=2" in shown
    line = next(line for line in shown.splitlines() if "picture: " in line)
    picture = Path(line.split("picture: ")[1].strip())
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert f'name="discmech picture" value="{picture}"' in (pytester.path / "found.xml").read_text()


@pytest.mark.slow
def test_files_are_found_beside_the_test_and_questions_without_an_answer_are_errors(pytester):
    folder = pytester.mkdir("sub")
    folder.joinpath("near.py").write_text(
        RULE
        + """
from discmech import Scene, pair

free = Scene("free", pair(1), lambda x, v, p: v[0] ** 2 / 2, x0=[1], v0=[0])
"""
    )
    folder.joinpath("broken.py").write_text("import nothing_of_this_name")
    folder.joinpath("test_near.py").write_text("""
def test_found(assert_reversible):
    assert_reversible("near.py:two_thirds", "near.py:free", digits=16)
    assert_reversible("triple-jump:near.py:two_thirds", "near.py:free", digits=16)

def test_no_quantities(assert_momentum):
    assert_momentum("midpoint", "near.py:free")

def test_broken(assert_order):
    assert_order("broken.py:two_thirds", "kepler")
""")
    done = pytester.runpytest_subprocess(
        "-p", "no:discmech", "-p", "discmech.studies.plugin", "-p", "no:cacheprovider", timeout=120
    )
    done.assert_outcomes(passed=1, failed=2)
    shown = done.stdout.str()
    assert "BadInput: free declares no momentum map and no Casimir" in shown
    assert "BadInput: broken.py" in shown and "pytest.skip()" in shown


def test_the_entry_point_is_the_plugin():
    declared = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    assert declared["project"]["entry-points"]["pytest11"] == {
        "discmech": "discmech.studies.plugin"
    }
    plugin = importlib.import_module("discmech.studies.plugin")
    assert plugin.pytest_runtest_makereport
    for name in ("order", "converges", "symplectic", "momentum", "energy", "reversible"):
        assert getattr(plugin, name) and getattr(assertions, f"assert_{name}").__doc__


@pytest.mark.slow
def test_the_order_asked_for_is_judged_from_both_sides():
    assert assert_order(lopsided, "pendulum", 1)["measured"]["order"] == pytest.approx(1, abs=0.01)
    with pytest.raises(Missed, match="above the expected 1"):
        assert_order("rectangle", "rigid-body", 1)  # there it has order 2
    assert_order("rectangle", "rigid-body")  # which is derived


@pytest.mark.slow
def test_what_is_not_self_adjoint_is_not_reversible():
    with pytest.raises(Missed, match=r"not the inverse") as caught:
        assert_reversible(lopsided, "kepler", digits=30)
    assert caught.value.picture.read_bytes().startswith(b"\x89PNG")
    assert_reversible("triple-jump:midpoint", "kepler", digits=30)


@pytest.mark.slow
def test_a_map_under_a_force_has_no_work_to_hold_a_momentum_against():
    turned = Conserved("angular momentum", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])
    scene = scenes.get("kepler").with_values(
        name="rubbed", force=lambda x, v, p: [-v[0] / 9, -v[1] / 9], symmetries=[turned]
    )
    with pytest.raises(BadInput, match=r"rubbed with explicit-euler.* no discrete work"):
        assert_momentum("explicit-euler", scene)
    assert_momentum("midpoint", scene)


def test_a_step_with_some_arguments_filled_in_is_a_step():
    def verlet(q, p, h, system, share):
        p = p - share * h * system.gradient(q, p)
        q = q + h * system.velocity(q, p)
        return q, p - (1 - share) * h * system.gradient(q, p)

    assert_order(partial(verlet, share=0.5), "harmonic", 2)
    with pytest.raises(Missed):
        assert_order(partial(verlet, share=0.25), "harmonic", 2)


def test_what_does_not_converge_is_missed():
    @discretisation()
    def wrong(L, G, x, u, h):
        return h * L(x, 2 * u)

    with pytest.raises(Missed, match=r"asks for at least 1\. Cause: .* not consistent") as caught:
        assert_converges(replace(wrong, name="wrong:a=1/10"), "pendulum", digits=30)
    assert caught.value.picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("words", "message"), [
    (("midpont", "kepler", 2), "did you mean midpoint"),
    (("midpoint", "keplr", 2), "did you mean kepler"),
    (("kepler", "midpoint", 2), "midpoint is a rule, where a scene is asked for: swap the two"),
    ((scenes.get("kepler"), lopsided, 2), "lopsided is a rule, where a scene is asked for"),
    ((scenes.get("kepler"), "pendulum"), "kepler is a scene, where a rule is asked for"),
    (("midpoint", "kepler", "2"), "the order asked for is '2'"),
    ((lopsided, "kepler"), r"declares no order, so nothing could fail: .*'kepler', order=2\)"),
    ((discretisation(name="column")(lambda L, G, x, u, h: h * u), "kepler", 2), "is a matrix"),
])  # fmt: skip
def test_what_cannot_be_asked_is_bad_input_and_no_missed_order(words, message):
    with pytest.raises(BadInput, match=message) as caught:
        assert_order(*words)
    assert "\n" not in str(caught.value)


def test_the_keys_of_what_is_measured_that_the_page_names_are_those_of_the_studies():
    page = (ROOT / "docs/how-to/pytest.md").read_text("utf-8").partition("keys of `[")[2]
    rows = re.findall(r"^\| (\w+)[^|]*\| (.+) \|$", page, re.MULTILINE)
    names = {"symplectic": "symplecticity", "reversible": "reversibility"}
    assert len(rows) == 5
    for word, keys in rows:
        study = every_study()[names.get(word, word)].name
        known = NAMES if study == "symplecticity" else view_of(study).measured.__annotations__
        assert {*re.findall(r"`(\w+)`", keys)} <= {*known}, word
