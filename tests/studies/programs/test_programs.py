"""Kinds of programs, what may be given beside a step, and what is remembered of them."""

import ctypes
import dataclasses
import sys
import types

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from discmech import BadInput, Scene, Scheme, black_box, external, pair, recorded, scenes
from discmech.integrators import rules
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.foreign import derivative, images, noise_of
from discmech.studies import own_order
from discmech.studies.core.case import Case
from discmech.studies.core.claims import claiming
from discmech.studies.core.side_by_side import key_of
from discmech.studies.core.study import every_study
from discmech.studies.evidence import evidence_of
from discmech.studies.evidence.order import _round_off
from discmech.studies.symplecticity import in_numbers
from discmech.studies.symplecticity.form_in_numbers import loop_defect, random_curve
from discmech.studies.symplecticity.leaves import leaf_defect
from discmech.studies.symplecticity.places import looks

from . import methods
from .judging import judged
from .methods import kick_drift_kick


@pytest.mark.parametrize(("numbers", "kind"), [("double", float), ("float32", np.float32)])
def test_the_step_is_a_plain_number(numbers, kind):
    """A float of Python prints as 0.1 and divides as floats do, and libraries in C take it."""
    seen = []

    def step(q, p, h, system):
        seen.append(h)
        return q, p

    def run(q, p, h, steps, every, system):
        seen.append(h)
        return np.array([q] * (steps + 1)), np.array([p] * (steps + 1))

    class Memory:
        start = staticmethod(lambda q, p, h, system: seen.append(h) or (q, p))
        step = staticmethod(lambda state, h, system: seen.append(h) or state)
        read = staticmethod(lambda state, system: state)

    for function, runs in ((step, False), (run, True), (Memory, False)):
        box = black_box(runs=runs, numbers=numbers)(function)
        Scheme(scenes.get("kepler"), box).flow("1/10").trajectory(1)
    assert {type(h) for h in seen} == {kind} and len(seen) == 4


def test_velocities_digits_and_whole_runs():
    @black_box(order=2, state="qv")
    def moving(q, v, h, s):
        q, p = kick_drift_kick(q, s.momentum(q, v), h, s)
        return q, s.velocity(q, p)

    @black_box(order=2, runs=True)
    def whole(q, p, h, steps, every, s):
        rows = [(q, p)]
        for k in range(1, steps + 1):
            q, p = kick_drift_kick(q, p, h, s)
            if k % every == 0:
                rows.append((q, p))
        return tuple(np.array(part) for part in zip(*rows, strict=True))

    wanted = Scheme(scenes.get("kepler"), methods.verlet).flow("0.01").trajectory(100, 10)
    for box in (moving, whole, dataclasses.replace(methods.verlet, numbers="any")):
        run = Scheme(scenes.get("kepler"), box).flow("0.01").trajectory(100, 10)
        assert np.abs(run.x - wanted.x).max() < 1e-13
    many = Scheme(scenes.get("kepler"), box).flow("0.01", digits=50).trajectory(10)
    rule = Scheme(scenes.get("kepler"), rules.trapezoidal).flow("0.01", digits=50).trajectory(10)
    assert max(abs(many.mu[-1] - rule.mu[-1])) < 1e-48


@pytest.mark.slow
def test_claims_alone_are_judged():
    claimed = dataclasses.replace(methods.rk4, claims=rules.Claims(keeps=("energy",)))
    assert judged("energy", "pendulum", claimed, 5000)["verdict"] == "fail"
    found = judged("energy", "pendulum", methods.rk4, 500)
    assert found["verdict"] == "measured" and "does not claim" in found["expected"]["not_demanded"]


def test_a_hamiltonian_in_numbers():
    given = {"name": "table", "groupoid": pair(1), "x0": ["1"], "mu0": ["0.3"], "step": "0.1"}
    energy = {"numeric_hamiltonian": lambda q, p: p[0] ** 2 / 2 - np.cos(q[0])}
    scene = Scene(**given, **energy, gradient=lambda q, p: (np.sin(q), p))
    found = judged("order", scene, methods.verlet)
    assert found["verdict"] == "pass" and found["expected"]["agreed"] >= 11
    assert judged("symplecticity", scene, methods.verlet)["verdict"] == "pass"
    wrong = Scene(**given, **energy, gradient=lambda q, p: (np.cos(q), p))
    with pytest.raises(BadInput, match=r"by q\[0\] it gives"):
        Scheme(wrong, methods.verlet)
    with pytest.raises(BadInput, match="only black boxes run on it"):
        Scheme(scene, rules.midpoint)


def test_the_round_off_near_a_pole_is_no_jump():
    """Its round-off is far larger at some points of a line than at most."""
    z, scale = np.array([0.02, 0.03, -0.6, 2.0]), np.ones(4)
    flow = Scheme(scenes.get("kepler"), methods.verlet).flow("0.001")
    for seed in range(8):
        assert not noise_of(flow.map_of(), z, scale, 2.0**-53, seed).jump.any()


@pytest.mark.parametrize(("stop", "noisy"), [(1e-9, True), (0.0, False)])
def test_a_smooth_map_near_a_pole_has_no_noise_but_an_iteration_that_stops_early_has(stop, noisy):
    """Its sixth differences are as large as those of noise, and sink on a finer line."""

    def root(z):
        guess = 1.0
        for _ in range(200):
            guess, before = (guess + 1 / (abs(z[0]) * guess)) / 2, guess
            if abs(guess - before) <= stop * guess:
                break
        return np.array([guess + stop * np.sin(1e7 * z[0])])

    level = max(noise_of(root, np.array([0.05]), np.ones(1), 2.0**-53, k).level[0]
                for k in range(8))  # fmt: skip
    assert bool(level > 1e-12) is noisy


def test_a_small_coordinate_is_seen_beside_a_large_one():
    """The derivative of what a large coordinate rounds, by one that moves a millionth of it."""
    scale = np.array([1e-6, 1.0])

    def f(y):
        return np.array([np.sin(1 + y[0]) + np.cos(y[1]), y[0]])

    found = derivative(f, 2, scale, noise_of(f, np.zeros(2), scale, 2.0**-53))
    assert abs(found.value[0, 0] - np.cos(1)) <= found.error[0, 0] < 1e-12

    def flat(y):
        return np.array([np.tanh(1e3 * y[0]) + y[1]])

    found = derivative(flat, 1, scale, noise_of(flat, np.zeros(2), scale, 2.0**-53))
    assert abs(found.value[0, 0] - 1e3) <= found.error[0, 0] < 1e-3


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_slope_beside_the_knots_of_a_spline_is_within_its_error(degree):
    """Several knots may err alike at neighbouring widths, and are no noise of narrow stencils."""
    random, close = np.random.default_rng(degree), 0
    for seed in range(24):
        x = np.linspace(-4, 4, int(2 ** random.uniform(4, 10)))
        kick = make_interp_spline(x, np.sin(x) * (1 + np.cos(7 * x) / 3), degree)
        slope, (h, q, p) = kick.derivative(), random.uniform((0.3, -1.2, -1.2), (1, 1.2, 1.2))

        def step(y, h=h, q=q, p=p, kick=kick):
            half = p + y[1] - h / 2 * kick(q + y[0])
            end = q + y[0] + h * half
            return np.array([end, half - h / 2 * kick(end)])

        scale = np.full(2, 2.0)
        of = derivative(step, 2, scale, noise_of(step, np.zeros(2), scale, 2.0**-53, seed))
        kicks = [np.array([[1, 0], [-h / 2 * slope(at), 1]]) for at in (q, step(np.zeros(2))[0])]
        gap = np.abs(of.value - kicks[1] @ [[1, h], [0, 1]] @ kicks[0])
        assert (gap <= of.error).all()
        close += of.error.max() < 1e-9
    assert close > 12


def test_closed_curves_over_the_knots_of_a_spline_show_no_defect():
    """Half the points of one from the first place tell the same by chance."""
    x = np.linspace(-4, 4, 162)
    energy = make_interp_spline(x, -np.cos(x) * (1 + np.cos(3 * x) / 5), 3)
    slope = energy.derivative()
    scene = Scene(
        name="knots-1", groupoid=pair(1), x0=["1"], mu0=["0.3"], duration=10, step="0.1",
        numeric_hamiltonian=lambda q, p: p[0] ** 2 / 2 + float(energy(q[0])),
        gradient=lambda q, p: (slope(q), p),
    )  # fmt: skip
    case = Case("symplecticity", scene, methods.verlet, 16)
    (first, *_), scale, seed = looks(case.scheme)
    row = in_numbers._row(case, 0, first, scale, seed)
    assert row.loop and row.certain < 1e-13


@pytest.mark.slow
def test_a_momentum_of_0_has_the_round_off_of_what_it_becomes():
    found = evidence_of(Scheme(scenes.get("pendulum"), methods.yoshida)).order
    assert found.order == pytest.approx(4, abs=0.1)


def test_a_rounding_in_coordinates_of_ones_own_moves_all_entries():
    """Of a quaternion an entry of its matrix that is small is off by what the large ones are."""
    place = types.SimpleNamespace(x=(0.1, -0.9), mu=(0.0, 2.0))
    own = dataclasses.replace(methods.verlet, write=lambda *z: z, read=lambda *z: z)
    found = [_round_off(Scheme(scenes.get("kepler"), box).flow("0.1"), place)
             for box in (own, methods.verlet)]  # fmt: skip
    assert [[e * 2**52 for e in sizes] for sizes in found] == [[0.9, 0.9, 2, 2], [0.1, 0.9, 0, 2]]


def split_body(q, p, h, s):
    """Turns about the axes in turn, each a flow of a part of the rigid body's energy."""
    rates = [s.velocity(q, e)[i] for i, e in enumerate(np.eye(3))]
    for i, part in ((0, 0.5), (1, 0.5), (2, 1), (1, 0.5), (0, 0.5)):
        p = turned(p, i, part * h * p[i] * rates[i])
    return q, p


def turned(p, i, angle):
    c, s, j, k = np.cos(angle), np.sin(angle), (i + 1) % 3, (i + 2) % 3
    found = p.copy()
    found[j], found[k] = c * p[j] + s * p[k], c * p[k] - s * p[j]
    return found


@pytest.mark.parametrize("more", [
    lambda p: p, lambda p: p * (1 + 1e-8), lambda p: turned(p, 2, 1e-8 * p[0]),
    lambda p: p * (1 + 1e-8 * p[0]),
])  # fmt: skip
def test_areas_on_leaves_are_kept_by_what_keeps_the_bracket(more):
    box = black_box(name="split")(lambda q, p, h, s: (q, more(split_body(q, p, h, s)[1])))
    flow = Scheme(scenes.get("rigid-body"), box).flow("0.1")
    f, z, scale = flow.map_of(), np.array([0.6, -0.8, 0.9]), np.ones(3)
    ways = random_curve(np.random.default_rng(7), 0 * z, scale, 0.08)
    noise = noise_of(f, z, scale, 2.0**-53)
    found = leaf_defect(f, lambda c: flow.system.tensor(c[:0], c), z, scale, ways, noise)
    assert found.resolution < 1e-12
    if np.array_equal(more(z), z):
        assert found.certain == 0 and found.measured < 1e-14
    else:
        assert 1e-9 < found.certain < 1e-7


def test_the_leaf_of_a_pair_groupoid_is_all_of_it():
    flow = Scheme(scenes.get("pendulum"), methods.rk4).flow("0.5")
    f, z, scale = flow.map_of(), np.array([0.7, 0.4]), np.ones(2)
    curve, noise = random_curve(np.random.default_rng(1), z, scale, 0.08), noise_of(f, z, scale, 0)
    found = leaf_defect(f, lambda c: flow.system.tensor(c[:1], c[1:]), z, scale, curve - z, noise)
    same = loop_defect(f, curve, 1, noise)
    # relative to other absolute terms: ∮|p dq| and half of ∮(|p dq| + |q dp|)
    assert 1e-6 < same.certain / 2 < found.certain < 2 * same.certain


@pytest.mark.slow
@pytest.mark.parametrize(("force", "verdict"), [
    (lambda x, v, p: [x[1], x[0]], "fail"), (lambda x, v, p: [x[1], -x[0]], "measured"),
    (lambda x, v, p: [-v[0], 0], "measured"),
])  # fmt: skip
def test_a_force_with_a_potential_leaves_the_form_to_be_kept(force, verdict):
    forced = Scene(
        name="forced", groupoid=pair(2), lagrangian=lambda x, v, p: (v[0] ** 2 + v[1] ** 2) / 2,
        force=force, x0=["1", "0.2"], v0=["0.3", "-0.4"], duration=5, step="0.2",
    )  # fmt: skip
    claimed = dataclasses.replace(methods.rk4, claims=rules.Claims(symplectic=True))
    found = judged("symplecticity", forced, claimed, causes=False)
    assert found["verdict"] == verdict
    assert ("forced" in str(found["expected"].get("not_demanded"))) == (verdict == "measured")


def test_what_all_that_it_reads_is_known_of_is_remembered(tmp_path):
    def key(box):
        case = Case("order", scenes.get("pendulum"), box, 16, None)
        return key_of(every_study()["order"], case)

    def turned_by(angle):
        return black_box(name="turn")(lambda q, p, h, s: (q + angle * h * p, p))

    assert key(turned_by(1)) == key(turned_by(1)) != key(turned_by(2))
    assert key(claiming(methods.rk4, "energy")) != key(methods.rk4) != key(methods.verlet)
    for step in (
        lambda q, p, h, s: (q + np.loadtxt("table"), p),
        lambda q, p, h, s: (q + np.random.standard_normal(), p),
        lambda q, p, h, s: (q + ctypes.c_double(1).value, p),
    ):
        assert key(black_box(name="reads")(step)) is None
    code = tmp_path / "code.py"
    code.write_text("1")
    words = [sys.executable, str(code)]
    assert key(external(words)) is None
    known = [key(external(words, files=files)) for files in ((), [tmp_path])]
    code.write_text("2")
    assert len({*known, *(key(external(words, files=files)) for files in ((), [tmp_path]))}) == 4
    with pytest.raises(BadInput, match="there is no gone"):
        external(words, files=["gone"])
    with pytest.raises(BadInput, match="give a list of paths"):
        external(words, files="code.py")


def jacobian(q, p, h, s):
    """Of a step of Störmer–Verlet on the pendulum."""
    Q = q + h * (p - h / 2 * np.sin(q))
    kick = np.array([[[1, 0], [-h / 2 * float(np.cos(at[0])), 1]] for at in (q, Q)])
    return kick[1] @ np.array([[1, h], [0, 1]]) @ kick[0]


@pytest.mark.slow
def test_a_derivative_of_ones_own_is_taken_in_place_of_differences():
    own = dataclasses.replace(methods.verlet, jacobian=jacobian)
    found = judged("symplecticity", "pendulum", own, causes=False)
    assert found["verdict"] == "pass" and found["measured"]["resolution"] < 1e-13
    damped = dataclasses.replace(own, jacobian=lambda *a: jacobian(*a) * (1 - 1e-9))
    found = judged("symplecticity", "pendulum", damped, causes=False)
    assert found["verdict"] == "fail"
    flat = dataclasses.replace(own, jacobian=lambda *a: jacobian(*a)[0])
    found = judged("symplecticity", "pendulum", flat, causes=False)
    assert found["verdict"] != "pass" and "its jacobian has the shape (2,)" in found["reason"]


@pytest.mark.slow
def test_a_derivative_of_ones_own_has_to_be_that_of_the_steps():
    """A shear keeps the form: only the steps themselves tell that it is not their derivative."""
    shear = np.array([[1, 1e-7], [0, 1]])
    box = dataclasses.replace(methods.verlet, jacobian=lambda *a: jacobian(*a) @ shear)
    found = judged("symplecticity", "pendulum", box, causes=False)
    assert found["verdict"] == "fail"
    assert "its jacobian is not the derivative of its step" in found["reason"]


def test_coordinates_of_ones_own_lead_there_and_back():
    """Degrees and momenta in thousandths."""

    def degrees(x, mu):
        return np.degrees(x), 1000 * mu

    def radians(q, p):
        return np.radians(q), p / 1000

    @black_box(order=2, symplectic=True, write=degrees, read=radians, vectorised=True)
    def scaled(q, p, h, s):
        return degrees(*kick_drift_kick(*radians(q, p), h, s))

    run, same = (Scheme(scenes.get("pendulum"), box).flow("0.1").trajectory(50)
                 for box in (scaled, methods.verlet))  # fmt: skip
    assert np.abs(run.x - same.x).max() < 1e-13 and np.abs(run.mu - same.mu).max() < 1e-13
    with pytest.raises(BadInput, match="give both read= and write="):
        black_box(write=degrees)
    one = dataclasses.replace(scaled, read=lambda q, p: q)
    with pytest.raises(BadInput, match="read= must give a pair of arrays"):
        Scheme(scenes.get("pendulum"), one).flow("0.1").trajectory(1)


@pytest.mark.parametrize("scene", ["pendulum", "heavy-top", "duffing"])
def test_many_states_in_one_call_are_those_of_each_alone(scene):
    flow, sizes = Scheme(scenes.get(scene), methods.rk4).flow("0.01"), []

    @black_box(order=4, vectorised=True)
    def at_once(q, p, h, s):
        sizes.append(p.shape[1:])
        return methods.rk4_step(s.f, q, p, h)

    run = flow.trajectory(30)
    q, p = run.x.T, run.mu.T
    for what in ("H", "gradient", "velocity", "force", "momentum", "tensor"):
        several = getattr(flow.system, what)(q, p)
        alone = [getattr(flow.system, what)(*one) for one in zip(run.x, run.mu, strict=True)]
        assert np.abs(several - np.moveaxis(np.array(alone), 0, -1)).max(initial=0) < 1e-13
    states = np.hstack([run.x, run.mu])
    f = Scheme(scenes.get(scene), at_once).flow("0.01").map_of(2)
    assert np.abs(images(f, states) - images(flow.map_of(2), states)).max() < 1e-13
    assert sizes.count((31,)) == 2 and len(sizes) < 8

    @black_box(order=2, vectorised=True)
    def mixed(q, p, h, s):
        return q, p * (1 + 1e-9 * np.sum(p))

    with pytest.raises(BadInput, match="let each column be a state of its own"):
        images(Scheme(scenes.get(scene), mixed).flow("0.01").map_of(), states)


def test_a_flipped_term_of_second_order_is_named():
    @black_box(order=2)
    def velocity_verlet(q, p, h, s):
        g = s.gradient(q, p)
        Q = q + h * s.velocity(q, p) + h**2 / 2 * g
        return Q, p - h / 2 * (g + s.gradient(Q, p))

    found = judged("order", "pendulum", velocity_verlet)["diagnosis"]
    assert found["cause"] == "flipped sign" and "h² of x" in found["sentence"]


def test_an_order_by_its_own_runs_says_that_their_limit_may_be_wrong(tmp_path):
    @black_box(order=2)
    def alone(q, p, h):
        p = p + h / 2 * np.sin(q)  # the sign is wrong, which nothing here can tell
        q = q + h * p
        return q, p + h / 2 * np.sin(q)

    found = own_order(alone, q=[0.3], p=[0], step="0.1", steps=20)
    assert found.order == pytest.approx(2, abs=0.01)
    assert "nothing says that the limit of these runs is right" in str(found)
    for k in range(5):
        h, n = 0.1 / 2**k, 20 * 2**k
        box = dataclasses.replace(alone, formula=lambda q, p, h, s: alone.formula(q, p, h))
        run = Scheme(scenes.get("pendulum"), box).flow(str(h)).trajectory(n)
        np.savez(tmp_path / f"{k}.npz", t=run.t, q=run.x, p=run.mu)
    runs = recorded(str(tmp_path / "*.npz"), 2)
    assert own_order(runs).order == pytest.approx(2, abs=0.01)
    tmp_path.joinpath("4.npz").unlink()
    tmp_path.joinpath("3.npz").unlink()
    few = own_order(recorded(str(tmp_path / "*.npz"), 2))
    assert few.order is None and "needs 4 runs or more; there are 3." in str(few)
    tmp_path.joinpath("1.npz").unlink()
    np.savez(tmp_path / "4.npz", t=run.t, q=run.x, p=run.mu)
    with pytest.raises(BadInput, match="half the step of the one before"):
        own_order(recorded(str(tmp_path / "*.npz"), 2))
    with pytest.raises(CannotMeasure, match=r"asks for system\.gradient, but without a scene"):
        own_order(methods.verlet, q=[0.3], p=[0], step="0.1")
    with pytest.raises(BadInput, match="needs q, p, a step"):
        own_order(alone)
    flat = own_order(black_box()(lambda q, p, h: (q, p)), q=[1], p=[0], step=1)
    assert flat.order is None and "tell no order" in flat.sentence
