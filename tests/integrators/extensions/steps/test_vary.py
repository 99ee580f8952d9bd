"""Rules whose steps vary: physical time, order, the way back, and what is refused."""

import pickle

import mpmath
import numpy as np
import pytest
import sympy

from discmech import Scene, Scheme, compose, in_own_time, midpoint, pair, scenes, solution, vary
from discmech.integrators.errors import BadInput, CannotMeasure, StepFailure
from discmech.integrators.extensions.steps import ENERGY
from discmech.integrators.numbers import exact_rational
from discmech.integrators.rules import get

KEPLER = scenes.get("kepler")


def distance(x, mu, p):
    return sympy.sqrt(x.dot(x))


def square(x, mu, p):
    return x.dot(x)


def fall(x, mu, p):
    return x.dot(x) ** sympy.Rational(3, 4)


def slow(x, mu, p):
    return 1 / (1 + mu.dot(mu))


def scheme(rule="trapezoidal", way="reversible", sigma=square, scene=KEPLER):
    return Scheme(scene, vary(get(rule), sigma, way))


def energies(run):
    return (run.mu**2).sum(axis=1) / 2 - 1 / np.sqrt((run.x**2).sum(axis=1))


@pytest.mark.parametrize("way", ["poincare", "reversible", "naive"])
def test_rows_have_the_physical_time(way):
    """The step from row to row is about ε σ, however many rows are left out."""
    flow = scheme(way=way, sigma=distance).flow("1/50")
    run = flow.trajectory(200)
    sizes = np.sqrt((run.x**2).sum(axis=1))
    middle = (sizes[1:] + sizes[:-1]) / 2
    assert np.allclose(np.diff(run.t), middle / 50, rtol=0.03)
    assert np.allclose(run.density * sizes, 1, atol=0.01)
    assert np.array_equal(flow.trajectory(200, 40).t, run.t[::40])
    assert flow.trajectory(10, t0="1/2").t[0] == 0.5


@pytest.mark.dear(but=("naive", "midpoint"))
@pytest.mark.parametrize(
    ("rule", "way", "order", "sigma"),
    [("rectangle", "poincare", 1, square), ("trapezoidal", "poincare", 2, square),
     ("gauss-2", "poincare", 4, distance), ("triple-jump:rectangle", "poincare", 4, square),
     ("trapezoidal", "reversible", 2, square), ("gauss-2", "reversible", 4, slow),
     ("triple-jump:trapezoidal", "reversible", 4, square),
     ("triple-jump:rectangle", "reversible", 4, square),
     ("implicit-midpoint", "reversible", 2, distance), ("trapezoidal", "naive", 2, square)],
)  # fmt: skip
def test_the_order_at_the_times_that_are_reached(rule, way, order, sigma):
    """In ε, against the reference at the physical time of the last row."""
    made, errors = scheme(rule, way, sigma), []
    for n in (400, 800) if order == 1 else (100, 200):
        run = made.flow(sympy.Rational(4, n), digits=30).trajectory(n, n)
        exact = solution(KEPLER, exact_rational(run.t[-1], "t"), digits=35, proof=False)
        with mpmath.workdps(30):
            off = [*(run.x[-1] - np.array(exact.x)), *(run.mu[-1] - np.array(exact.mu))]
            errors.append(float(mpmath.norm(off)))
    assert made.order == order
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25 if order == 1 else 0.1)


def test_double_precision_and_many_digits_agree():
    made = scheme("kahan-li-6:trapezoidal")
    runs = [made.flow("1/20", digits).trajectory(100, 100) for digits in (16, 40)]
    ends = [np.array([*r.x[-1], *r.mu[-1], r.t[-1], r.density[-1]], float) for r in runs]
    assert np.allclose(*ends, rtol=1e-12)


def test_a_composition_changes_its_density_once_a_step():
    """In the size of all its substeps together, t moves by ε over the density."""
    run = scheme("kahan-li-6:trapezoidal", sigma=distance).flow("1/20").trajectory(50)
    between = (run.density[1:] + run.density[:-1]) / 2  # ζ at half a step is linear in G
    assert np.allclose(np.diff(run.t) * between, 1 / 20, rtol=0.01)


def test_reversible_steps_go_back_and_naive_ones_do_not():
    off = {}
    for way in ("reversible", "poincare", "naive"):
        made = scheme("kahan-li-6:trapezoidal", way)
        run = made.flow("1/20").trajectory(300)
        more = {"reversible": {"density0": run.density[-1]}, "naive": {}}
        more["poincare"] = {"energy0": made.inner.scene.parameters.get(ENERGY)}
        again = made.flow("-1/20").trajectory(
            300, x0=run.x[-1], mu0=run.mu[-1], t0=run.t[-1], **more[way]
        )
        off[way] = max(abs(again.x[-1] - run.x[0]).max(), abs(again.t[-1]))
        assert made.self_adjoint == (way != "naive")
    assert off["reversible"] < 1e-12 and off["poincare"] < 1e-12
    assert off["naive"] > 1e-4


def test_the_naive_step_drifts_and_the_others_do_not():
    """Kepler's energy over some 150 periods by the trapezoidal rule: the means of its tenths."""
    moved = {}
    for way in ("reversible", "poincare", "naive"):
        errors = energies(scheme(way=way, sigma=fall).flow("1/8").trajectory(12_000)) + 0.5
        tenth = len(errors) // 10
        moved[way] = abs(errors[-tenth:].mean() - errors[:tenth].mean()) / np.ptp(errors[:tenth])
    assert moved["reversible"] < 0.02 and moved["poincare"] < 0.02
    assert moved["naive"] > 0.2


@pytest.mark.parametrize(
    ("way", "periods"),
    [("reversible", 500),
     *(pytest.param(way, 10_000, marks=pytest.mark.slow) for way in ("reversible", "poincare"))],
)  # fmt: skip
def test_an_eccentric_orbit_of_many_periods(way, periods):
    """e = 0.99: the energy keeps its band, and its mean stays where it is."""
    scene = KEPLER.with_values(x0=["1/100", 0], v0=[0, sympy.sqrt(199)])
    flow = scheme("kahan-li-8:trapezoidal", way, fall, scene).flow("1/16")
    run = flow.until(2 * np.pi * periods, every=7)
    errors = energies(run) / -0.5 - 1
    tenth = len(errors) // 10
    assert np.ptp(errors) < 1e-9
    # at a pericentre terms of 200 |E| are rounded, 4e-14 of E: a walk of some such steps a period
    assert abs(errors[-tenth:].mean() - errors[:tenth].mean()) < 1e-13 * np.sqrt(periods)


@pytest.mark.slow
def test_the_pythagorean_problem_beside_its_reference():
    """Behind the first encounters, at the time that is reached."""
    scene = scenes.get("pythagorean")
    run = scheme("kahan-li-8:trapezoidal", sigma=None, scene=scene).flow("1/96").until(6)
    exact = solution(scene, exact_rational(run.t[-1], "t"), digits=20, proof=False)
    assert np.allclose(run.x[-1], np.array(exact.x, float), atol=1e-8)
    assert np.allclose(run.mu[-1], np.array(exact.mu, float), atol=1e-8)


def test_where_the_motion_is_at_a_time():
    """`until` ends at the first row whose time is the asked one or more."""
    flow = scheme(sigma=distance).flow("1/50")
    run = flow.until(5)
    assert run.t[-1] >= 5 > run.t[-2] and run.steps == len(run.t) - 1
    assert np.array_equal(run.t, flow.trajectory(run.steps).t)
    with pytest.raises(BadInput, match="time after"):
        flow.until(0)
    with pytest.raises(BadInput, match="200 steps end"):  # σ = x goes to 0
        scheme(sigma=lambda x, mu, p: x[0]).flow("1/10").until(5, most=200)


@pytest.mark.slow
def test_the_scene_in_its_own_time_is_a_scene():
    """K = σ (H − E₀) by a Hamiltonian and L̃ by a Lagrangian are one motion."""
    own = in_own_time(KEPLER, square)
    assert own.parameters[ENERGY] == sympy.Rational(-1, 2)
    assert [q.name for q in own.symmetries] == ["angular momentum"]
    by_h = Scene(
        name="kepler-by-h", groupoid=pair(2), parameters={"strength": 1}, x0=["2/5", 0],
        mu0=[0, 2], hamiltonian=lambda x, mu, p: mu.dot(mu) / 2 - p.strength / sympy.sqrt(x.dot(x)),
        symmetries=KEPLER.symmetries,
    )  # fmt: skip
    ends = [Scheme(in_own_time(s, square), midpoint).flow("1/10").trajectory(50).x[-1]
            for s in (KEPLER, by_h)]  # fmt: skip
    assert np.allclose(*ends, rtol=1e-12)
    lost = in_own_time(KEPLER, lambda x, mu, p: 1 + x[0] ** 2)
    assert not lost.symmetries  # σ turns with nothing
    assert not in_own_time(by_h, lambda x, mu, p: 1 + mu[0] ** 2).symmetries
    (kept,) = in_own_time(by_h, lambda x, mu, p: 1 + mu.dot(mu)).symmetries
    assert kept.name == "angular momentum"


@pytest.mark.slow
def test_the_poincare_way_is_the_rule_on_the_scene_in_its_own_time():
    run = scheme("gauss-2", "poincare").flow("1/10").trajectory(40)
    own = Scheme(in_own_time(KEPLER, square), get("gauss-2")).flow("1/10").trajectory(40)
    assert np.allclose(run.x, own.x, rtol=1e-12, atol=1e-14)
    assert np.all(np.diff(run.t) > 0) and not np.allclose(run.t, own.t)


@pytest.mark.slow
def test_it_takes_forces_and_times_and_groups_in_the_reversible_way():
    for name in ("heavy-top", "duffing"):
        scene = scenes.get(name)
        made = scheme("trapezoidal", sigma=slow, scene=scene)
        run = made.flow(scene.step).trajectory(50)
        exact = solution(scene, exact_rational(run.t[-1], "t"), digits=20, proof=False)
        assert np.allclose(run.x[-1], np.array(exact.x, float), atol=1e-2)
        assert np.allclose(run.mu[-1], np.array(exact.mu, float), atol=1e-2)


BAD = {
    "positive": (lambda x, mu, p: -x.dot(x), "sigma is -0.16"),
    "shape": (lambda x, mu, p: x, "sigma is a matrix \\(2, 1\\)"),
    "kink": (lambda x, mu, p: 1 + sympy.Abs(x[0]), "sigma is not smooth: it holds Abs"),
    "parameter": (lambda x, mu, p: p.mass, "the parameters are: strength"),
    "letter": (lambda x, mu, p: x[0] + sympy.Symbol("w"), "unknown symbol w"),
    "infinite": (lambda x, mu, p: x[0] / 0 * 1 if False else sympy.zoo, "finite"),
}


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("way", ["poincare", "reversible", "naive"])
def test_a_sigma_that_cannot_be_used(case, way):
    sigma, said = BAD[case]
    with pytest.raises((BadInput, StepFailure), match=said):
        scheme(way=way, sigma=sigma).flow("1/10").trajectory(10)


@pytest.mark.parametrize("way", ["poincare", "reversible", "naive"])
@pytest.mark.parametrize("every", [1, 50])
def test_a_sigma_that_stops_being_positive_names_step_time_and_state(way, every):
    with pytest.raises(StepFailure) as caught:
        scheme(way=way, sigma=lambda x, mu, p: x[0] + sympy.Rational(3, 10)).flow("1/2").trajectory(
            2000, every
        )
    failure = caught.value
    assert failure.step_index > 0 and failure.time > 0
    assert "x = [" in str(failure) and "at step" in str(failure) and "t = " in str(failure)
    assert failure.trajectory is None or failure.trajectory.x.shape[1] == 2


def test_what_is_refused():
    for given, said in (
        ((3, square), "is no rule"),
        ((vary(midpoint, square), square), "vary already"),
        ((midpoint, 3), "function"),
        ((midpoint, lambda x: 1), r"\(x, mu, p\)"),
        ((midpoint, square, "reversable"), "did you mean reversible"),
    ):
        with pytest.raises(BadInput, match=said):
            vary(*given)
    for name, way, said in (
        ("cartesian-pendulum", "reversible", "constraints"), ("duffing", "poincare", "force"),
        ("rigid-body", "poincare", "no base"),
    ):  # fmt: skip
        with pytest.raises(CannotMeasure, match=said):
            scheme(way=way, scene=scenes.get(name))
    with pytest.raises(CannotMeasure, match="one-step map"):
        scheme("implicit-midpoint", "poincare")
    with pytest.raises(BadInput, match="depends on mu"):
        scheme(way="poincare", sigma=slow)
    with pytest.raises(BadInput, match="no energy"):
        scheme().flow("1/10").trajectory(1, energy0=1)
    with pytest.raises(BadInput, match="has steps that vary: compose"):
        compose(vary(midpoint, square), "suzuki")


def test_what_is_of_equal_steps_alone_is_refused():
    flow = scheme().flow("1/10")
    for name in ("derivatives", "tangent", "evolve", "poisson_defect", "step_defect", "gradient"):
        with pytest.raises(CannotMeasure, match="steps that vary"):
            getattr(flow, name)([1, 0], [0, 1])
    x, mu = flow.dual_step([1, 0], [0, 1])
    run = flow.trajectory(1, x0=[1, 0], mu0=[0, 1])
    assert np.array_equal([x, mu], [run.x[-1], run.mu[-1]])


def test_it_goes_to_another_process():
    flow = scheme().flow("1/10")
    again = pickle.loads(pickle.dumps(flow))
    assert np.array_equal(again.trajectory(20).x, flow.trajectory(20).x)
