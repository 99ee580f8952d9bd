"""One-step maps in studies and commands: they go wherever a rule goes."""

import json

import pytest

from discmech import BadInput, check
from discmech.integrators.rules import MAPS, get
from discmech.studies.core.case import Choice

MINE = '''"""Two maps: of order four, and one that is singular."""
from discmech import one_step


@one_step(order=4)
def rk4(s, z, h):
    k1 = s.f(z)
    k2 = s.f(z + h * k1 / 2)
    k3 = s.f(z + h * k2 / 2)
    return z + h * (k1 + 2 * k2 + 2 * k3 + s.f(z + h * k3)) / 6


@one_step(order=2, implicit=True)
def implicit_midpoint(s, z, Z, h):
    return Z - z - h * s.f((z + Z) / 2)
'''
BAD = {
    "shape": ("    return z[:1, :]", "gives Z of shape 1×1"),
    "nothing": ("    pass", "gives Z None"),
    "raises": ("    raise RuntimeError('no')", "RuntimeError: no"),
    "differentiates": ("    return z + h * s.f(z).diff(z[0])", "s.df is the derivative of s.f"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty current folder with a good file of maps, and bad ones."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)
    head = "from discmech import one_step\n\n@one_step(order=1)\ndef bad(s, z, h):\n"
    for name, (line, _) in BAD.items():
        (tmp_path / f"{name}.py").write_text(head + line + "\n")
    return tmp_path


def verdicts(study, scene, names, **how):
    found = check(study, [scene], names, **how)
    return {c["rule"]: c["verdict"] for c in found["cases"]}


def test_rules_that_no_one_asks_for_do_not_join_in():
    """They are listed apart, and a study of everything is one of variational rules."""
    rules = {rule.name for _, rule in Choice().pairs()}
    assert not rules & set(MAPS)
    assert all(get(name) is rule for name, rule in MAPS.items())
    with pytest.raises(BadInput, match="did you mean runge-kutta-4"):
        get("runge-kuta-4")


@pytest.mark.slow
def test_the_midpoint_on_a_lie_poisson_system_is_caught():
    """It keeps energy and Casimirs of the rigid body, and no bracket."""
    (case,) = check("symplecticity", ["rigid-body"], ["implicit-midpoint"], [50], 8)["cases"]
    assert case["verdict"] == "fail" and case["measured"]["pullback"] is None
    assert case["measured"]["poisson"] > 1e-6 and case["measured"]["residual"] < 1e-45
    assert "one-step map itself" in case["diagnosis"]["sentence"]
    (kept,) = verdicts("energy", "rigid-body", ["implicit-midpoint"], steps=5000).values()
    assert kept == "pass"


def test_where_a_map_has_no_meaning_it_is_no_failure():
    found = check("order", ["rigid-body", "pendulum"], ["stoermer-verlet"], [50], 16)
    assert [c["scene"] for c in found["cases"]] == ["pendulum"]
    assert "exists on pair groupoids only" in found["notes"][0]
    with pytest.raises(BadInput, match="exists on pair groupoids only"):
        check("order", ["rigid-body"], ["stoermer-verlet"])


@pytest.mark.slow
def test_verify_and_compare(folder, ask):
    quick = ("--scene", "rigid-body", "--study", "order", "--digits", "50", "--steps", "16")
    code, out, err = ask("verify", "mine.py", *quick, "--jobs", "1", "--json", "-")
    assert (code, err) == (0, "")
    found = json.loads(out)
    orders = {c["rule"]: c["measured"]["order"] for c in found["cases"]}
    assert orders == {
        "rk4": pytest.approx(4, abs=0.02),
        "implicit-midpoint": pytest.approx(2, abs=0.01),
    }
    adjoint = {s["rule"]: s["self_adjoint"] for s in found["schemes"]}
    assert adjoint == {"rk4": False, "implicit-midpoint": True}
    code, out, _ = ask("compare", "mine.py", "midpoint", *quick, "--jobs", "1", "--json", "-")
    assert code == 0
    assert {line["rule"] for line in json.loads(out)["comparison"]} == {*orders, "midpoint"}


@pytest.mark.parametrize("name", BAD)
def test_bad_maps_exit_with_2_and_a_sentence(folder, ask, name):
    for words in (
        ("run", "pendulum", "--rule", f"{name}.py"),
        ("verify", f"{name}.py", "--scene", "pendulum", "--jobs", "1"),
    ):
        code, _, err = ask(*words)
        assert code == 2
        (line,) = err.splitlines()
        assert f"{name}.py, line" in line and BAD[name][1] in line


@pytest.mark.slow
def test_run_list_and_explain(ask):
    code, out, _ = ask("run", "heavy-top", "--rule", "average-vector-field", "--step", "-0.01",
                       "--steps", "3", "--json", "-")  # fmt: skip
    run = json.loads(out)
    assert code == 0 and run["t"][-1] == -0.03 and run["energy_error"] < 1e-14
    code, out, _ = ask("explain", "rigid-body", "discrete-gradient")
    assert code == 0 and "one-step map" in out and "self-adjoint (derived)" in out
    code, out, _ = ask("list")
    assert "one step maps:" in out and "  rkmk-4" in out


def test_constraints_are_refused_in_a_sentence(ask):
    code, _, err = ask("order", "suslov", "--rule", "heun")
    assert code == 2 and "suslov has constraints" in err
