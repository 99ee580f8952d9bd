"""The modified equation: f̃ = B dH̃ by order, closed forms, and H̃ kept to the stated order."""

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, pair, retractions, rules, scenes
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.expansions import TooLong, laurent
from discmech.studies.systems.modified_energy import dual_of

slow = pytest.mark.slow


def modified(scene, rule, order, digits=16, retraction=None):
    given = scenes.get(scene) if isinstance(scene, str) else scene
    if retraction:
        given = given.with_retraction(retractions.get(retraction))
    return Scheme(given, rules.get(rule)).modified_equation(order, digits)


def along(equation, steps, divisor=1):
    """The states of a run, and its step."""
    scheme = equation.scheme
    flow = scheme.flow(scheme.scene.step / divisor, equation.numbers.digits)
    run = flow.trajectory(steps * divisor, max(1, steps * divisor // 32))
    return np.hstack([run.x, run.mu]), flow.step


GROUPOIDS = [
    ("pendulum", "gauss-2", 5, None),
    ("rigid-body", "midpoint", 4, "cayley"),
    ("rotor-body", "rectangle", 3, "cayley"),
    pytest.param("heavy-top", "trapezoidal", 4, "exponential", marks=slow),
    pytest.param("wong", "midpoint", 3, "cayley", marks=slow),
    pytest.param("spherical-pendulum", "gauss-2", 5, "cayley", marks=slow),
    pytest.param("kirchhoff", "kahan-li-6:trapezoidal", 6, "cayley", marks=slow),
    pytest.param("reduced-kepler", "lobatto-3", 5, "exponential", marks=slow),
]


@pytest.mark.parametrize(("scene", "rule", "order", "retraction"), GROUPOIDS)
def test_each_field_is_that_of_its_hamiltonian(scene, rule, order, retraction):
    """f_j = B dH_j by differences at 50 digits, and f₁, H₁ are those of the scene."""
    equation = modified(scene, rule, order, 50, retraction)
    z = along(equation, 1)[0][-1:]
    size = z.shape[1]
    with mpmath.workdps(70):
        d = mpmath.mpf(10) ** -20
        around = [z[0] + sign * d * np.eye(size, dtype=int)[i]
                  for i in range(size) for sign in (1, -1)]  # fmt: skip
        H = equation.hamiltonian(np.array([z[0], *around]))
        slopes = ((H[:, 1::2] - H[:, 2::2]) / (2 * d)).astype(float)
    fields = equation.field(z)[:, 0].astype(float)
    dual = dual_of(equation.scheme.scene)
    B = dual.poisson(z.astype(float))[0]
    for f, slope in zip(fields, slopes, strict=True):
        np.testing.assert_allclose(f, B @ slope, rtol=0, atol=1e-14 * max(1, abs(slope).max()))
    energy, _, own, *_ = dual(z.astype(float))
    np.testing.assert_allclose(fields[0], own[0], atol=1e-15)
    np.testing.assert_allclose(float(H[0, 0]), energy[0], rtol=1e-15)


#: (scene, rule, order, step's divisor): the truncated H̃ errs by the first power left out; more
#: are the study's (`tests/studies/test_modified.py`)
KEPT = [("kepler", "midpoint", 4, 2), ("rigid-body", "midpoint", 4, 1)]


@pytest.mark.parametrize(("scene", "rule", "order", "divisor"), KEPT)
def test_the_modified_hamiltonian_is_kept_to_the_stated_order(scene, rule, order, divisor):
    """Up to h^j, j = p, …, the change along a run falls with the first power that is left out."""
    equation = modified(scene, rule, order)
    first = equation.scheme.order
    even = equation.scheme.self_adjoint
    rows = []
    for part in (divisor, 2 * divisor):
        z, step = along(equation, 16, part)
        H = equation.hamiltonian(z)
        sums = [equation.at_step(H[: j + 1], step) for j in range(order + 1)]
        rows.append([np.ptp(e) for e in sums])
    slopes = np.log2(np.array(rows[0]) / np.array(rows[1]))
    for j in range(first - 1, order + 1):
        wanted = first if j < first else j + 1
        assert slopes[j] > wanted - 0.35, (j, slopes, rows)
    if even:  # no odd powers: the next one is two more
        assert slopes[order] > order + (2 if order % 2 == 0 else 1) - 0.35, (slopes, rows)


def test_a_method_that_loses_energy_has_no_modified_hamiltonian():
    equation = modified("henon-heiles", "runge-kutta-4", 6)
    ranges = []
    for part in (1, 2):
        z, step = along(equation, 16, part)
        H = equation.hamiltonian(z)
        ranges.append(np.ptp(equation.at_step(H, step)))
    assert np.log2(ranges[0] / ranges[1]) < 5.5  # where 7 would be that of the first power left out


h, omega = sympy.symbols("h omega", positive=True)
#: published frequencies of the oscillator (Hairer, Lubich, Wanner, VIII.1 and IX.1)
FREQUENCIES = {
    "trapezoidal": 2 / h * sympy.asin(h * omega / 2),  # Störmer–Verlet
    "midpoint": 2 / h * sympy.atan(h * omega / 2),
    "gauss-2": 2 / h * sympy.atan((h * omega / 2) / (1 - (h * omega) ** 2 / 12)),
}


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["trapezoidal", "midpoint", "gauss-2"])
def test_the_frequency_of_the_oscillator(rule):
    order = 6
    equation = modified("harmonic", rule, order)
    s = equation.scheme.equations.s
    H = sum(e * h**j for j, e in enumerate(equation.formulas.hamiltonian))
    unit = dict.fromkeys(s.parameter_list, sympy.Integer(1))
    names = {str(e): e for e in s.parameter_list}
    H = H.subs({**unit, names["stiffness"]: omega**2})
    (x,), (mu,) = s.x, s.mu
    squared = H.diff(x, 2) * H.diff(mu, 2) - H.diff(x, mu) ** 2
    wanted = FREQUENCIES[rule] ** 2
    left = sympy.series(wanted, h, 0, order + 1).removeO() - sympy.expand(squared)
    assert sympy.series(left, h, 0, order + 1).removeO() == 0


@slow
@pytest.mark.parametrize("rule", ["midpoint", "trapezoidal"])
def test_the_precession_of_kepler(rule):
    """The mean of H₃ over an orbit turns the ellipse: dϖ/dt = h² ∂⟨H₃⟩/∂L at a constant action.

    L is conjugate to the direction ϖ of the ellipse, and the mean at constant ∮p dq (so at constant
    energy, in a Kepler orbit) is a function of L alone.
    """
    given = scenes.get("kepler")
    scheme = Scheme(given, rules.get(rule))
    equation = scheme.modified_equation(2)
    eccentricity = 0.6

    def mean(e):
        """⟨H₃⟩ over the orbit of semi-axis 1 and eccentricity e, and its L."""
        E = 2 * np.pi * np.arange(512) / 512
        r, b = 1 - e * np.cos(E), np.sqrt(1 - e * e)
        z = np.stack([np.cos(E) - e, b * np.sin(E), -np.sin(E) / r, b * np.cos(E) / r], axis=1)
        return (equation.hamiltonian(z)[2] * r).mean(), b

    high, low = mean(eccentricity + 1e-4), mean(eccentricity - 1e-4)
    rate = (high[0] - low[0]) / (high[1] - low[1])
    found = []
    for k in (128, 256):
        flow = scheme.flow(sympy.Rational(1, k))
        turns, speed = 20, np.sqrt((1 + eccentricity) / (1 - eccentricity))
        steps = int(turns * 2 * np.pi * k)
        run = flow.trajectory(steps, x0=[1 - eccentricity, 0], mu0=[0, speed])
        x, p = run.x.T, run.mu.T
        L = x[0] * p[1] - x[1] * p[0]
        r = np.hypot(*x)
        A = np.array([p[1] * L - x[0] / r, -p[0] * L - x[1] / r])
        angle = np.unwrap(np.arctan2(A[1], A[0]))
        weights = np.hanning(len(angle)) * r  # but for what oscillates over an orbit
        times = run.t - run.t.mean()
        found.append((weights * times * angle).sum() / (weights * times**2).sum() * k**2)
    assert found[1] == pytest.approx(rate, rel=0.02)
    assert abs(found[1] - rate) < abs(found[0] - rate) + 1e-3 * abs(rate)


def of_mass(name, mass, x0="3/4"):
    """A scene of one coordinate and a mass M(x, p)."""
    return Scene(name=name, groupoid=pair(1), parameters={"k": "3/2"}, x0=[x0], v0=["1/2"],
                 lagrangian=lambda x, v, p: mass(x[0], p.k) * v[0] ** 2 / 2 - x[0] ** 2 / 2,
                 duration=4)  # fmt: skip


@pytest.mark.parametrize(("scene", "rule", "order"), [
    ("kepler", "trapezoidal", 2),
    (of_mass("cosine-mass", lambda x, k: 2 + sympy.cos(x)), "midpoint", 2),
    (of_mass("square-mass", lambda x, k: k + k**2 * x**2), "midpoint", 2),
    pytest.param("pendulum", "gauss-2", 4, marks=slow),
    pytest.param("rotor-body", "rectangle", 1, marks=slow),
])  # fmt: skip
def test_formulas_are_what_numbers_are(scene, rule, order):
    equation = modified(scene, rule, order)
    s, formulas = equation.scheme.equations.s, equation.formulas
    z, _ = along(equation, 3)
    at = dict(zip([*s.x, *s.mu], z[-1], strict=True))
    at |= dict(zip(s.parameter_list, map(float, equation.scheme.scene.parameter_values),
                   strict=True))  # fmt: skip
    found = [float(sympy.sympify(e).subs(at)) for e in formulas.hamiltonian]
    np.testing.assert_allclose(found, equation.hamiltonian(z)[:, -1], rtol=1e-12, atol=1e-14)
    fields = [[float(sympy.sympify(e).subs(at)) for e in term] for term in formulas.field]
    np.testing.assert_allclose(fields, equation.field(z)[:, -1], rtol=1e-12, atol=1e-14)


def test_a_sum_that_is_divided_by_replaces_its_parts():
    """With A = 2 + k cos x, cos and sin² are written in A, so that they cancel against 1/A."""
    x, k = sympy.symbols("x k", real=True)
    atoms = laurent.Atoms(exact=True)
    cos, sin = (atoms.function(name, atoms.letter(x)) for name in ("cos", "sin"))
    below = 2 + atoms.letter(k) * cos
    inverse = 1 / below
    assert below * inverse - 1 == 0
    assert len((sin * sin * inverse).terms) == 4  # 1/A − (A − 2)²/(k² A)
    other = 1 / (cos + sin)  # no rule: sin = B − cos would put cos² into its own
    assert len((other * cos * cos * sin).terms) <= 4


def test_a_formula_is_zero_where_it_is_at_random_points():
    x = sympy.Symbol("x", real=True)
    atoms = laurent.Atoms(exact=True)
    at = atoms.letter(x)
    double = atoms.function("sin", 2 * at)
    half = atoms.function("sin", at) * atoms.function("cos", at)
    assert atoms.is_zero(0) and atoms.is_zero(double - 2 * half)
    assert not atoms.is_zero(double - 2 * half + laurent.Fraction(1, 10**30))
    root = atoms.power(1 - at * at, laurent.Fraction(1, 2))
    assert atoms.is_zero(root * root + atoms.power(at, 2) - 1) and not atoms.is_zero(root - at)


def test_what_has_no_modified_equation_is_refused_in_a_sentence():
    for scene, rule, said in (
        ("cartesian-pendulum", "midpoint", "has constraints"),
        ("kapitza-pendulum", "midpoint", "has explicit time"),
        ("moser-veselov", "midpoint", "has a discrete Lagrangian"),
    ):
        with pytest.raises(CannotMeasure, match=said):
            modified(scene, rule, 2)
    for order in (0, 13, 2.0, True):
        with pytest.raises(BadInput, match="give the last power of the step"):
            modified("pendulum", "midpoint", order)
    with pytest.raises(BadInput, match="rows \\(x, mu\\) of 2 numbers"):
        modified("pendulum", "midpoint", 2).hamiltonian([1.0, 2.0, 3.0])
    with pytest.raises(CannotMeasure, match="has no discrete Lagrangian"):
        modified("rigid-body", "implicit-midpoint", 2).hamiltonian([[1.0, 2.0, 3.0]])


def test_formulas_that_would_take_minutes_are_refused(monkeypatch):
    monkeypatch.setattr(laurent, "MOST_SECONDS", 0.0)
    with pytest.raises(TooLong, match="ask for fewer powers of the step"):
        modified("kepler", "midpoint", 4).formulas  # noqa: B018
