"""The study of lattices: what is right passes, faults are caught, and other studies leave it."""

from copy import deepcopy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import sympy

from discmech import BadInput, Lattice, Scheme, pair
from discmech.integrators import rules, scenes
from discmech.integrators.extensions.lattices import DualStep, LatticeRun
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.extensions.lattices.lattice_equations import LatticeEquations
from discmech.integrators.extensions.lattices.sparse_steps import RELAXED
from discmech.studies import check, get
from discmech.studies.core.case import Case, Choice, silent
from discmech.studies.core.fingerprint import of_case
from discmech.studies.core.result import NONE
from discmech.studies.lattices import cost
from discmech.studies.lattices.faults import CONTROLS, RungeKuttaStep
from discmech.studies.lattices.records import Grows, Measured, Row
from discmech.studies.lattices.view import _cost
from discmech.studies.symplecticity.limits import LIMITS
from discmech.studies.systems import following, quantities, residual
from discmech.studies.systems.known import known_of
from discmech.studies.systems.quantities import energies
from discmech.studies.systems.reference import solution
from discmech.studies.systems.residual import step_defects
from tests.studies.as_json import run_case

STUDY = get("lattices")


def case(name, rule="trapezoidal", steps=None, control=None, study="lattices"):
    return Case(study, systems.get(name), rules.get(rule), 16, steps, control)


def found_by(study, lattice, rule, steps=None):
    lattice = systems.get(lattice) if isinstance(lattice, str) else lattice
    rule = rules.get(rule) if isinstance(rule, str) else rule
    return run_case(get(study), Case(study, lattice, rule, 16, steps))


@pytest.mark.parametrize(
    "control",
    [pytest.param(c, marks=pytest.mark.slow if CONTROLS[c][0] == "bodies" else ())
     for c in CONTROLS],
)  # fmt: skip
def test_faults_are_caught(control):
    name, rule, _ = CONTROLS[control]
    found = run_case(STUDY, case(name, rule, control=control))
    assert found["verdict"] == "pass", found["reason"]
    assert run_case(STUDY, case(name, rule, control=control))["control"]


@pytest.mark.dear("gauss-2")
@pytest.mark.parametrize(("rule", "order"), [("gauss-2", 4), ("trapezoidal", 2)])
def test_a_field_has_its_orders_in_time_and_in_space(rule, order):
    found = run_case(STUDY, case("breather", rule, 400))
    assert found["verdict"] == "pass", found["reason"]
    measured, in_time = found["measured"], found_by("order", "breather", rule)
    assert in_time["verdict"] == "pass" and abs(in_time["measured"]["order"] - order) < 0.05
    assert abs(measured["space_order"] - 2) < 0.05
    assert measured["patch"] < 1e-15 and measured["bond"] < 1e-14


@pytest.mark.parametrize(
    ("first", "last", "shown"),
    [(2.0, 2.0, "2 at 100000, slope 1.00"), (0.0, 2.0, "2 at 100000"), (2.0, 0.0, NONE)],
)
def test_a_clock_of_coarse_ticks_gives_no_slope(first, last, shown):
    rows = [{"kind": "cost", "sites": n, "nanoseconds": t, "bytes": 8.0}
            for n, t in zip((1e3, 1e4, 1e5), (first, 2.0, last), strict=True)]  # fmt: skip
    grows = Grows(cost.slopes(rows)["time"])
    case = SimpleNamespace(rows=[Row(**row) for row in rows], measured=Measured(grows=grows))
    assert _cost(case) == shown


@pytest.mark.slow
def test_every_lattice_passes():
    lattices = [c.scene for c in STUDY.cases(Choice()) if not c.control]
    for study in ("order", "energy", "momentum", "symplecticity"):
        found = check(study, [*dict.fromkeys(lattices), systems.get("beam")])
        assert found["verdict"] == "pass", [c["reason"] for c in found["cases"]]
    found = check("lattices")
    assert found["verdict"] == "pass", [c["reason"] for c in found["cases"]]
    slopes = [c["measured"]["grows"] for c in found["cases"] if not c["control"]]
    assert all(abs(s["memory"] - 1) < 0.1 for s in slopes if s)


@pytest.mark.slow
def test_the_beam_s_step_is_a_poisson_map():
    case = Case("symplecticity", systems.get("beam"), rules.get("trapezoidal"), 16, 400,
                thorough=True)  # fmt: skip
    found = run_case(get("symplecticity"), case)
    assert found["verdict"] == "pass" and found["measured"]["poisson"] < 1e-15


def in_round_offs(name, rule="trapezoidal"):
    """The residual of a step after some, in ε."""
    flow = Scheme(systems.get(name), rules.get(rule)).flow(systems.get(name).step)
    run = flow.trajectory(40, 40)
    return step_defects(flow, run.x[-1], run.mu[-1])["residual"] * 2**53


@pytest.mark.dear("bodies", "membrane")
@pytest.mark.parametrize(
    ("name", "rule"),
    [("breather", "trapezoidal"), ("membrane", "midpoint"), ("toda", "gauss-2"),
     ("bodies", "trapezoidal"), *(pytest.param("bodies", r, marks=pytest.mark.slow)
                                  for r in ("midpoint", "gauss-2")),
     pytest.param("beam", "trapezoidal", marks=pytest.mark.slow)],
)  # fmt: skip
def test_what_runs_are_the_maps_that_the_forms_are_measured_of(name, rule):
    assert in_round_offs(name, rule) < 1


@pytest.mark.parametrize("name", ["fput", "membrane"])
def test_a_force_that_is_wrong_in_the_kernel_alone_is_caught(name, monkeypatch):
    """One end of every bond has a millionth less force than what its derivatives are of."""
    right = LatticeEquations._kicks

    def wrong(self, what, *given):
        kicks = right(self, what, *given)
        parts = {}
        for side in ("minus", "plus"):
            force = getattr(kicks, side).copy()
            force[0] *= 1 - sympy.Rational(1, 10**6)
            parts[side] = force if what == "bond" else getattr(kicks, side)
        return replace(kicks, **parts)

    monkeypatch.setattr(LatticeEquations, "_kicks", wrong)
    assert in_round_offs(name) > 1e3 * LIMITS["step"]


def test_a_long_run_is_measured_as_its_rows_are(monkeypatch):
    """Some rows at a time, so that memory does not grow with the steps."""
    monkeypatch.setattr(following, "BLOCK", 3 * 32)
    lattice, scheme = systems.get("rotors"), Scheme(systems.get("rotors"), rules.get("midpoint"))
    flow, parts = scheme.flow(lattice.step), quantities.of_symmetries(lattice)
    found, run = following.followed(scheme, flow, 40, parts), flow.trajectory(40)
    H, size = energies(scheme, run)
    assert found.size == size and np.array_equal(found.t, run.t) and np.array_equal(found.energy, H)
    along, total = found.momenta["total momentum"], run.mu.sum(axis=(1, 2))
    assert np.array_equal(along.drifts,
                          abs(total - total[0]) / abs(run.mu).sum(axis=(1, 2)).max())  # fmt: skip
    assert min(along.units) > 0
    for k, (t, x, mu) in zip((0, 20, 40), found.states, strict=True):
        assert t == run.t[k] and np.array_equal(x, run.x[k]) and np.array_equal(mu, run.mu[k])


def test_of_many_sites_some_are_asked_and_the_ends():
    asked = residual._asked(systems.fput(5000))
    assert 1000 <= asked.sum() <= 1010
    assert not asked[[0, -1]].any()  # they are fixed
    assert asked[1] and asked[-2]
    assert residual._asked(systems.fput(500)).sum() == 498


@pytest.mark.slow
def test_a_solver_that_ends_early_is_caught(monkeypatch):
    right = LatticeRun._task

    def early(self, task, j):
        found = right(self, task, j)
        if task == RELAXED:
            self.past[0][:] *= 1 + 1e-8
        return found

    monkeypatch.setattr(LatticeRun, "_task", early)
    assert in_round_offs("membrane", "midpoint") > 1e3 * LIMITS["step"]


@pytest.mark.slow
def test_the_solution_is_as_near_to_the_closed_form_as_it_says():
    lattice = systems.get("toda")
    scheme, inner = Scheme(lattice, rules.get("trapezoidal")), slice(8, -8)  # without the ends
    for t in (0.5, 1.0, 2.0, 4.0):
        *found, known = solution(scheme, t)
        wanted = known_of(lattice).exact(lattice, t)
        off = [abs(a[:, 0] - b)[inner].max() / abs(b).max()
               for a, b in zip(found, wanted, strict=True)]  # fmt: skip
        assert max(off) < known < 10 * max(off)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("space_order", 1.0, "in space is 1.000, below"), ("bond", 1e-9, "does not lose"),
        ("patch", np.nan, "some is lost there"),
        ("residual", 1e-9, "not that of the equations"),
    ],
)  # fmt: skip
def test_a_number_that_is_wrong_is_a_fail(name, value, words):
    asked = case("breather", steps=100)
    good = {"measured": {"space_order": 2.0, "residual": 0.0, "bond": 0.0, "patch": 0.0,
                         "local": None}}  # fmt: skip
    assert STUDY.judge(asked, good).verdict == "pass"
    bad = deepcopy(good)
    bad["measured"][name] = value
    verdict = STUDY.judge(asked, bad)
    assert verdict.verdict == "fail" and words in verdict.reason


@pytest.mark.parametrize(
    ("study", "name", "value"),
    [("symplecticity", "residual", 1e-9), ("symplecticity", "poisson", 1e-9),
     ("momentum", "drift", {"total momentum": 1e-9}), ("energy", "slope", 1e-3)],
)  # fmt: skip
def test_a_number_of_a_lattice_that_is_wrong_is_a_fail(study, name, value):
    asked, of_study = case("rotors", steps=100, study=study), get(study)
    found = {**of_study.measure(asked, silent)}
    assert of_study.judge(asked, found).verdict == "pass"
    found["measured"][name] = value
    for row in found["rows"] if study == "symplecticity" else ():
        row[name] = value
    if study == "energy":
        found["measured"] |= {"slope_interval": [value, value], "edge_slopes": [value, value]}
        found |= {"slopes": [value, value], "steady": 1.0}
    assert of_study.judge(asked, found).verdict == "fail"


@pytest.mark.slow
def test_an_energy_that_comes_and_goes_slowly_is_no_fail():
    """Within t = 640 the chain gives its energy to other modes for the first time."""
    found = found_by("energy", "fput", "midpoint", 100)
    assert found["verdict"] == "pass" and found["duration"] < 700
    limit = found["expected"]["modified_limit"]  # the modified energy stays to round-off
    assert limit < 1e-7 * found["measured"]["band"]


@pytest.mark.slow
def test_the_modified_energy_tells_an_energy_that_wanders_slowly():
    """Of gauss-2 in 2,000 steps, where the energy itself was told by 8 million."""
    found = found_by("energy", "toda", "gauss-2", 2000)
    assert found["verdict"] == "pass"
    assert found["duration"] <= 200 * 64


@pytest.mark.slow
def test_an_energy_that_drifts_is_a_fail(monkeypatch):
    right = following.energies

    def drifting(scheme, run):
        H, size = right(scheme, run)
        return H + 1e-6 * size * run.t, size

    monkeypatch.setattr(following, "energies", drifting)
    found = found_by("energy", "rotors", "midpoint", 2000)
    assert found["verdict"] == "fail" and "the energy drifts" in found["reason"]


def test_a_step_that_is_not_found_is_a_fail():
    """At h = 2 a potential with V″ = −1 leaves no u in F⁻."""
    flat = Lattice("flat", pair(1), 3, {}, lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2 / 2,
                   lambda x, y, p: -((x[0] - y[0]) ** 4), x0=np.ones((3, 1)),
                   v0=np.zeros((3, 1)), step=2)  # fmt: skip
    for study in ("energy", "symplecticity", "lattices"):
        found = found_by(study, flat, "midpoint", 10)
        assert found["verdict"] == "fail" and "singular" in found["reason"], study


def turning(**symmetries):
    """Bodies in the plane, on springs to their neighbours in a ring."""
    angle = 2 * np.pi * np.arange(8) / 8
    return Lattice(
        "turning", pair(2), 8, {"mass": np.linspace(1, 2, 8)},
        lambda x, v, p: p.mass * v.dot(v) / 2,
        lambda x, y, p: -(((y - x).dot(y - x) - 1) ** 2) / 4, "ring",
        x0=np.stack([np.cos(angle), np.sin(angle)], axis=1),
        v0=np.stack([-np.sin(angle) / 3, np.cos(angle) / 4 + 0.1], axis=1), step="1/50",
        symmetries=symmetries,
    )  # fmt: skip


@pytest.mark.slow
def test_a_symmetry_of_one_s_own_gives_a_momentum_that_is_judged():
    right = {"along": lambda x, p: [1, 0], "turn": lambda x, p: [-x[1], x[0]]}
    found = found_by("momentum", turning(**right), "midpoint", 2000)
    assert found["verdict"] == "pass", found["reason"]
    assert set(found["measured"]["drift"]) == {"along", "turn"}
    assert max(found["measured"]["rate"].values()) < 1e-13
    wrong = turning(stretch=lambda x, p: [x[0] * p.mass, x[1]])
    momentum = get("momentum")
    case = Case("momentum", wrong, rules.get("midpoint"), 16, 2000)
    found = run_case(momentum, case)
    assert found["verdict"] == "fail" and "is no symmetry of L" in found["reason"]
    keys = {
        of_case(momentum, c, timed=False) for c in (case, replace(case, scene=turning(**right)))
    }
    assert len(keys) == 2
    with pytest.raises(BadInput, match="the symmetry short gives 1 entries; give a list of 2"):
        Scheme(turning(short=lambda x, p: [1]), rules.get("midpoint"))


def test_the_control_s_derivative_is_that_of_its_step():
    """Else the law would be broken by a wrong derivative, and not by the method."""
    flow = Scheme(systems.get("breather"), rules.get("midpoint")).flow("1/8")
    start = flow.trajectory(4, 4)
    x, mu = start.x[-1], start.mu[-1]
    random, free = np.random.default_rng(3), flow.lattice.free[:, None]
    way = [random.normal(size=x.shape) * free for _ in "xm"]
    step, delta = RungeKuttaStep(flow, x, mu), 1e-5
    ends = [RungeKuttaStep(flow, x + s * way[0], mu + s * way[1]).after for s in (delta, -delta)]
    for k, found in enumerate(step.applied(tuple(way))[:2]):
        assert abs((ends[0][k] - ends[1][k]) / (2 * delta) - found).max() < 1e-8
    exact = DualStep(flow, x, mu).after  # midpoint is of order 2, so they agree to h³
    assert 1e-9 < abs(exact[0] - step.after[0]).max() < 1e-2


def ring(name, x0, step):
    return Lattice(
        name=name, site=pair(1), sites=16, bonds="ring", x0=x0, v0=np.zeros((16, 1)), step=step,
        on_site=lambda x, v, p: v[0] ** 2 / 2, on_bond=lambda x, y, p: -((x[0] - y[0]) ** 2) / 2,
    )  # fmt: skip


@pytest.mark.slow
def test_a_lattice_at_rest_is_neither_right_nor_wrong():
    """And one of yours that is called as a built-in one is judged as yours: with Ω."""
    mine = ring("beam", np.zeros((16, 1)), "0.1")
    (found,) = check("order", [mine], ["trapezoidal"])["cases"]
    assert found["verdict"] == "inconclusive" and "round-off" in found["reason"]
    (found,) = check("symplecticity", [mine], ["trapezoidal"], steps=200)["cases"]
    assert found["verdict"] == "pass" and found["measured"]["poisson"] < 1e-13


def test_a_report_of_a_scene_and_a_lattice_says_of_each_what_is_for_it():
    """Other people's integrators were asked whether a lattice has constraints."""
    chosen = Choice(scenes=(scenes.get("cartesian-pendulum"), systems.get("breather")))
    said = " ".join(get("work-precision").notes(chosen))
    assert "cartesian-pendulum is left out" in said and "breather" not in said
