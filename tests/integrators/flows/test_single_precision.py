"""Runs in single precision: floor and drift of the energy are those that are derived."""

import json

import numpy as np
import pytest

from discmech.integrators import BadInput, Scheme, rules, scenes
from discmech.studies.command.entry import main
from discmech.studies.systems.modified_energy import FARTHEST, dual_of

slow = pytest.mark.slow
EPS = 2.0**-24


def parts_of(scheme, step, steps):
    """(the difference of energies of a run in single and in double precision, its bound)."""
    single = scheme.flow(step, 7).trajectory(steps)
    double = scheme.flow(step).trajectory(steps)
    assert single.x.dtype == single.mu.dtype == single.u.dtype == np.float32
    return energies_apart(scheme, step, single, double)


def energies_apart(scheme, step, single, double):
    dual = dual_of(scheme.scene)
    at = [np.hstack([run.x, run.mu]).astype(float) for run in (single, double)]
    H = [dual(z)[0] for z in at]
    _, _, f, slope = dual(at[1])[:4]
    floor = abs(slope * at[1]).sum(axis=1).max()
    walk = abs(slope * f).sum(axis=1).max() * float(step) * FARTHEST * np.sqrt(len(f))
    return abs(H[0] - H[1]), EPS * (floor + walk)


@pytest.mark.parametrize(("scene", "rule", "step", "steps"), [
    ("pendulum", "midpoint", "0.125", 2000),
    pytest.param("rigid-body", "trapezoidal", "0.125", 500, marks=slow),
    pytest.param("henon-heiles", "gauss-2", "0.25", 2000, marks=slow),
    pytest.param("heavy-top", "midpoint", "0.0625", 1000, marks=slow),
    pytest.param("spherical-pendulum", "trapezoidal", "0.0625", 1000, marks=slow),
    pytest.param("pendulum", "runge-kutta-4", "0.0625", 1000, marks=slow),
    pytest.param("pendulum", "triple-jump:trapezoidal", "0.125", 1000, marks=slow),
])  # fmt: skip
def test_the_energy_differs_by_floor_and_walk(scene, rule, step, steps):
    scheme = Scheme(scenes.get(scene), rules.get(rule))
    apart, bound = parts_of(scheme, step, steps)
    assert apart.max() <= bound
    assert apart.max() > EPS * 1e-2  # it is no double precision


@slow
def test_sums_that_are_cut_off_leave_the_bound():
    scheme = Scheme(scenes.get("pendulum"), rules.get("midpoint"))
    flow = scheme.flow("0.125", 7)
    start = flow.trajectory(0)
    xs, mus = [start.x[0]], [start.mu[0]]
    for _ in range(2000):
        run = scheme.flow("0.125").trajectory(1, x0=xs[-1].astype(float), mu0=mus[-1].astype(float))
        for rows, e in ((xs, run.x[1]), (mus, run.mu[1])):
            near = e.astype(np.float32)
            over = abs(near) > abs(e)
            rows.append(np.where(over, np.nextafter(near, np.float32(0)), near))
    single = type("Rows", (), {"x": np.array(xs), "mu": np.array(mus)})
    double = scheme.flow("0.125").trajectory(2000)
    apart, bound = energies_apart(scheme, "0.125", single, double)
    assert apart.max() > 2 * bound


def test_single_precision_is_asked_of_runs_alone(capsys):
    assert main(["run", "pendulum", "--rule", "midpoint", "--steps", "5", "--digits", "7",
                 "--json", "-"]) == 0  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    assert found["digits"] == 7 and np.float32(found["x"][-1][0]) == found["x"][-1][0]
    assert main(["order", "pendulum", "--rule", "midpoint", "--digits", "7"]) == 2
    assert "give 16 (double precision) up to" in capsys.readouterr().err
    scheme = Scheme(scenes.get("pendulum"), rules.get("midpoint"))
    for digits in (6, 8, 15, 7.0):
        with pytest.raises(BadInput, match="or 7 \\(single precision\\)"):
            scheme.flow("0.1", digits)
    with pytest.raises(BadInput, match="larger than any number of single precision"):
        scheme.flow("0.1", 7).trajectory(1, x0=[0], mu0=[1e60])
