"""Optimal control: closed forms, the costate as a gradient, and symmetry."""

from functools import cache

import mpmath
import numpy as np
import pytest
import sympy
from scipy.linalg import expm

from discmech import Control, Scene, Scheme, midpoint, pair, rectangle, scenes
from discmech.integrators import retractions
from discmech.integrators.extensions.control.scenes import get
from discmech.integrators.rules import gauss, lobatto, trapezoidal


@cache
def problem(name):
    return get(name)


@cache
def solved(name, steps, rule):
    return problem(name).solve(steps, rule)


def effort(x, v, f, p):
    return f.dot(f) / 2


def mass(**changes):
    given = {"name": "mass", "groupoid": pair(1), "lagrangian": lambda x, v, p: v.dot(v) / 2,
             "x0": [0], "v0": [0], "duration": 1, **changes}  # fmt: skip
    return Scene(**given)


def plane(**changes):
    return mass(groupoid=pair(2), x0=[0, 0], v0=[0, 0], **changes)


def from_rest_to_rest(t):
    return np.array([3 * t**2 - 2 * t**3, 6 * t - 6 * t**2, -12 + 0 * t, 12 * t - 6]).T


def by_its_gramian(t):
    """The oscillator of least energy: z′ = Az − BBᵀp, p′ = −Aᵀp with z(T) = 0."""
    A, B, z0, T = np.array([[0, 1], [-1, 0]]), np.array([[0], [1]]), np.array([1, 0.5]), 2
    whole = np.block([[A, -B @ B.T], [0 * A, -A.T]])
    end = expm(whole * T)
    start = np.append(z0, np.linalg.solve(end[:2, 2:], -end[:2, :2] @ z0))
    return np.array([expm(whole * e) @ start for e in t])


CLOSED = {"double-integrator": from_rest_to_rest, "oscillator": by_its_gramian}


def errors(name, steps, rule):
    """Largest errors of states, costates, controls at the nodes and controls inside the steps."""
    found = solved(name, steps, rule)
    some = slice(None, None, max(1, steps // 16))
    at, inside = CLOSED[name](found.t[some]), CLOSED[name](found.control_times[some].ravel())
    return np.array([
        abs(np.hstack([found.x, found.mu])[some] - at[:, :2]).max(),
        abs(found.costates[some] - at[:, 2:]).max(),
        abs(found.node_controls[some, 0] + at[:, 3]).max(),
        abs(found.controls[some].ravel() + inside[:, 3]).max(),
    ])  # fmt: skip


@pytest.mark.parametrize(
    "rule", [midpoint, gauss(2), *(pytest.param(r, marks=pytest.mark.slow) for r in
             (trapezoidal, lobatto(3)))], ids=lambda r: r.name,
)  # fmt: skip
def test_states_costates_and_controls_have_the_order_of_the_rule(rule):
    order = np.log2(errors("oscillator", 20, rule) / errors("oscillator", 40, rule))
    assert abs(order[:3] - rule.order).max() < 0.1
    assert order[3] > 1.9  # as collocation has it: a stage has the order of stages, + 1


def test_the_closed_forms_are_met_to_ten_digits():
    assert errors("oscillator", 320, gauss(2))[:3].max() < 1e-10
    assert errors("double-integrator", 10, gauss(2)).max() < 1e-12  # a cubic is of its space
    assert abs(solved("double-integrator", 10, gauss(2)).cost - 6) < 1e-12


def test_rectangle_is_of_order_one():
    coarse, fine = (errors("oscillator", k, rectangle)[0] for k in (40, 80))
    assert abs(np.log2(coarse / fine) - 1) < 0.1


@pytest.mark.parametrize("name", ["pendulum", pytest.param("heavy-top", marks=pytest.mark.slow)])
def test_the_costate_is_the_gradient_of_the_discrete_cost(name):
    """By differences of 50 digits, of steps that know nothing of control; that by f vanishes."""
    steps, scene = 4, scenes.get(name).with_values(duration=1, symmetries=())
    m = scene.groupoid.dim_u
    cost = {"cost": lambda x, v, f, p: f.dot(f) / 2 + v.dot(v) + v[0] ** 3 / 5}
    found = Control(scene, **cost, end=(None, None)).solve(steps)
    forced = Scene(
        "forced", scene.groupoid, scene.lagrangian, {**scene.parameters, "push": [0] * m},
        scene.x0, scene.v0, force=lambda x, v, p: list(p.push),
    )  # fmt: skip
    scheme, h = Scheme(forced, midpoint), mpmath.mpf(1) / steps

    def total(z, controls):
        value = 0
        for f in controls:
            flow = scheme.at(parameters={"push": list(f)}).flow("0.25", 50)
            n = len(z) - m
            u = flow.inverse_legendre(z[:n], z[n:])
            z = np.concatenate(flow.dual_step(z[:n], z[n:]))
            value += h * (sum(e**2 for e in f) / 2 + sum(e**2 for e in u) + u[0] ** 3 / 5)
        return value

    with mpmath.workdps(50):
        numbers = np.vectorize(mpmath.mpf, otypes=[object])
        start = numbers(np.append(found.x[0], found.mu[0]))
        controls, tiny = numbers(found.controls[:, 0]), mpmath.mpf(10) ** -20
        for i in range(len(start)):
            e = tiny * numbers(np.arange(len(start)) == i)
            slope = (total(start + e, controls) - total(start - e, controls)) / (2 * tiny)
            assert abs(slope - found.costates[0, i]) < 1e-13 * (1 + abs(slope))
        e = 0 * controls
        e[1, 0] = tiny
        slope = (total(start, controls + e) - total(start, controls - e)) / (2 * tiny)
        assert abs(slope) < 1e-14


@pytest.mark.slow
def test_the_costate_by_two_stages_is_the_gradient_too():
    """The cost as the momentum of a mass that C pushes, which steps weigh as they do a force."""
    steps, scene = 4, scenes.get("pendulum").with_values(duration=1, symmetries=())

    def cost(x, v, f, p):
        return f[0] ** 2 / 2 + v[0] ** 2 + v[0] ** 3 / 5 + sympy.sin(x[0])

    found = Control(scene, cost, end=(None, None)).solve(steps, gauss(2))
    start, first = np.append(found.x[0], found.mu[0]), found.control_times[0] * steps

    def push(x, v, p, t):
        (c, d), (f, g) = p.places, p.push
        at = f + (g - f) * (steps * t - c) / (d - c)
        return [at, cost(x, v, [at], p)]

    beside = Scene(
        "beside", pair(2), lambda x, v, p: scene.lagrangian(x[:1, :], v[:1, :], p) + v[1] ** 2 / 2,
        {**scene.parameters, "push": [0, 0], "places": list(first)}, [*scene.x0, 0], [*scene.v0, 0],
        force=push,
    )  # fmt: skip
    scheme = Scheme(beside, gauss(2))

    def total(z, controls):
        x, mu = [z[0], 0], [z[1], 0]
        for f in controls:
            flow = scheme.at(parameters={"push": list(f)}).flow("0.25", 50)
            (*x, _), mu = flow.dual_step([*x, 0], mu)
        return mu[1]

    with mpmath.workdps(50):
        numbers = np.vectorize(mpmath.mpf, otypes=[object])
        z, controls, tiny = numbers(start), numbers(found.controls[:, :, 0]), mpmath.mpf(10) ** -20
        assert abs(total(z, controls) - found.cost) < 1e-13
        for i in range(2):
            e = tiny * numbers(np.arange(2) == i)
            slope = (total(z + e, controls) - total(z - e, controls)) / (2 * tiny)
            assert abs(slope - found.costates[0, i]) < 1e-13 * (1 + abs(slope))
        for j in range(2):
            e = 0 * controls
            e[1, j] = tiny
            slope = (total(z, controls + e) - total(z, controls - e)) / (2 * tiny)
            assert abs(slope) < 1e-14


@pytest.mark.slow
@pytest.mark.parametrize("name", [
    "low-thrust-transfer", "upright-top",
])  # fmt: skip
def test_the_map_of_states_and_costates_is_symplectic(name):
    """Its derivative by differences of solved steps keeps dz ∧ dp, which ℒ generates."""
    found, stages = solved(name, 20, midpoint), problem(name).stages(midpoint)
    h, at = found.t[1], stages.slices
    d = stages.n + stages.m
    v = slice(at["w"].start, at["kappa"].stop)

    def step(z, p):
        """(z′, p′) with p = ∂ℒ/∂z, from the unknowns of that step."""
        y = np.concatenate([known[v], known[at["p"]]])
        for _ in range(20):
            g, H = stages(np.concatenate([z, y])[None], np.zeros(1), h)
            rest = np.concatenate([g[0, v], g[0, :d] - p])
            slope = np.vstack([H[0, v, d:], H[0, :d, d:]])
            y = y - np.linalg.solve(slope, rest)
        g, _ = stages(np.concatenate([z, y])[None], np.zeros(1), h)
        return np.concatenate([g[0, at["p"]], y[-d:]])

    k = 7
    g = np.hstack([found.x, found.mu])
    known = np.zeros(at["p"].stop)
    known[at["w"]] = np.append(found.u[k], np.zeros(at["w"].stop - at["w"].start - stages.m))
    known[at["f"]], known[at["p"]] = found.controls[k].ravel(), found.costates[k + 1]
    known[at["kappa"]] = found.costates[k + 1, stages.n :]
    start = np.append(g[k], found.costates[k])
    after = step(start[:d], start[d:])
    assert abs(after - np.append(g[k + 1], found.costates[k + 1])).max() < 1e-11
    eps = 1e-4
    columns = []
    for i in range(2 * d):
        e = eps * (np.arange(2 * d) == i)
        f = [step(*np.split(start + s * e, 2)) for s in (-2, -1, 1, 2)]
        columns.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * eps))
    M = np.array(columns).T
    J = np.block([[np.zeros((d, d)), np.eye(d)], [-np.eye(d), np.zeros((d, d))]])
    assert abs(M.T @ J @ M - J).max() < 1e-9 * abs(M).max() ** 2
    M[0] *= 1.001
    assert abs(M.T @ J @ M - J).max() > 1e-5


def turning(found):
    """p·(Jz) of the turns of the plane, at every node."""
    (px, py, pu, pv), (x, y), (u, v) = found.costates.T, found.x.T, found.mu.T
    return py * x - px * y + pv * u - pu * v


@pytest.mark.slow
def test_a_symmetry_of_the_problem_has_a_momentum_map():
    kepler = problem("low-thrust-transfer")
    for rule in (midpoint, gauss(2)):
        kept = turning(solved("low-thrust-transfer", 40, rule))
        assert np.ptp(kept) < 1e-13 and abs(kept).max() > 1e-5
    broken = Control(kepler.scene, lambda x, v, f, p: f[0] ** 2 + f[1] ** 2 / 2, kepler.end,
                     path=kepler.path).solve(40)  # fmt: skip
    assert np.ptp(turning(broken)) > 1e-4


@pytest.mark.slow
def test_a_turn_of_the_attitude_in_space_has_one_too():
    """p_A Aᵀ − A p_Aᵀ, since A ↦ BA is a symmetry whatever the inertia is."""
    found = solved("reorientation", 20, midpoint)
    A, p = found.x.reshape(-1, 3, 3), found.costates[:, :9].reshape(-1, 3, 3)
    kept = p @ A.transpose(0, 2, 1)
    kept = kept - kept.transpose(0, 2, 1)
    assert abs(kept - kept[0]).max() < 1e-12 * abs(kept).max()


@pytest.mark.parametrize("steps", [100, 1000, pytest.param(10_000, marks=pytest.mark.slow)])
def test_newton_does_not_know_the_number_of_steps(steps):
    assert solved("double-integrator", steps, midpoint).iterations <= 3
    assert solved("low-thrust-transfer", steps, midpoint).iterations <= 10


@pytest.mark.slow
@pytest.mark.parametrize("name", ["upright-top", "reorientation"])
def test_the_chart_does_not_matter(name):
    """The steps differ, the problem does not: the costs meet as the steps shrink."""
    of = problem(name)
    other = of.with_values(scene=of.scene.with_retraction(retractions.get("exponential")))
    gaps = [abs(of.solve(k).cost - other.solve(k).cost) for k in (10, 20)]
    assert 3 < gaps[0] / gaps[1] < 5  # by 4, of an order 2


@pytest.mark.parametrize("steps", [1, 2, 3])
def test_few_steps_are_enough(steps):
    found = Control(mass(), effort, end=([1], None)).solve(steps)
    assert abs(found.x[-1, 0] - 1) < 1e-14 and found.costates[-1, 1] == 0


def test_an_optimum_is_a_start_where_there_is_no_base():
    body = Control(scenes.get("rigid-body").with_values(duration=1), effort, end=(None, [0, 0, 0]))
    few = body.solve(8)
    assert body.solve(16, near=few).cost == pytest.approx(few.cost, rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["rigid-body", "damped-pendulum", "kapitza-pendulum", "rotor-body"]
)
def test_control_serves_every_groupoid_force_and_time(name):
    scene = scenes.get(name).with_values(duration=1)
    n, m = scene.groupoid.dim_x, scene.groupoid.dim_u
    for rule in (trapezoidal, midpoint, gauss(2)):
        found = Control(scene, effort, end=([0.25] * n, [0] * m)).solve(20, rule)
        assert abs(found.x[-1] - 0.25).max(initial=0) < 1e-12 and abs(found.mu[-1]).max() < 1e-12


def test_a_drive_of_a_known_time_is_seen():
    """Against a force t², f = −t² is free of cost, at the times of the points of every step."""
    scene = mass(force=lambda x, v, p, t: [t**2])
    still = Control(scene, lambda x, v, f, p, t: (f[0] + t**2) ** 2, end=([0], [0]))
    found = still.solve(20, gauss(2))
    assert (
        abs(found.x).max() < 1e-14
        and abs(found.controls + found.control_times[..., None] ** 2).max() < 1e-13
    )


def test_a_solution_begun_near_another_is_of_its_branch():
    """Past a hill below the line there are two ways; near a coarse one the other is not met."""

    def cost(x, v, f, p):
        return f.dot(f) / 2 + 100 * sympy.exp(-20 * ((x[0] - 0.5) ** 2 + (x[1] + 0.1) ** 2))

    def above(t):
        return [t, 4 * t * (1 - t)]

    problem = Control(plane(), cost, ([1, 0], [0, 0]))
    coarse = problem.with_values(path=above).solve(20, gauss(2))
    alone, near = problem.solve(40), problem.solve(40, near=coarse)
    assert alone.x[20, 1] < 0 < near.x[20, 1]
    assert abs(near.cost / coarse.cost - 1) < 0.01


def test_a_motion_that_grows_is_steered():
    """A swing-up that takes 20 units of time: e²⁰ hides from a Gramian what its last steps do."""
    pendulum = scenes.get("pendulum").with_values(x0=[0], v0=[0], symmetries=())
    found = Control(pendulum, effort, ([np.pi], [0]), duration=20).solve(400)
    assert abs(found.x[-1, 0] - np.pi) < 1e-12 and found.cost < 1
