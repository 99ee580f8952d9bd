"""What an exported file offers: parameters, energy and momenta, failures, refusals."""

import math
import re
import types

import mpmath
import numpy as np
import pytest
import sympy

from discmech import Lattice, Scene, Scheme, lie_group, midpoint, pair, scenes, trapezoidal
from discmech.integrators import BadInput, black_box, retractions
from discmech.integrators.algebras import sl
from discmech.integrators.retractions import exponential
from discmech.integrators.rules import get
from discmech.studies.core.case import Case
from discmech.studies.systems import system_of


def chain(sites=4, mass=1, stiffness=1, **more):
    return Lattice(name="chain", site=pair(1), sites=sites,
                   parameters={"mass": mass, "stiffness": stiffness},
                   on_site=lambda x, v, p: p.mass * v[0] ** 2 / 2,
                   on_bond=lambda x, y, p: p.stiffness * sympy.cos(y[0] - x[0]),
                   **{"bonds": "chain", "x0": [[0.1 * (i % 3)] for i in range(sites)],
                      "v0": [[0]] * sites, "duration": 1, **more})  # fmt: skip


def turned(name):
    return scenes.get(name).with_retraction(exponential)


SL3 = Scene(name="sl3", groupoid=lie_group(sl(3), exponential), x0=[], v0=[1] + ["0.1"] * 7,
            lagrangian=lambda x, v, p: v.dot(v) / 2, duration=1)  # fmt: skip
OWN = Scene(name="mine", groupoid=pair(2), parameters={"a": "0.5", "h": 3, "lambda_": [1, 2]},
            lagrangian=lambda x, v, p: v.dot(v) / 2 - p.a * x[0] ** 4 - p.h * x[1] ** 2,
            x0=[1, 1], v0=[0, 0], duration=1)  # fmt: skip


def module(scheme):
    """The exported file in numpy, run."""
    found = types.ModuleType("exported")
    exec(scheme.export("numpy"), vars(found))
    return found


def test_a_step_changes_the_state_in_place_and_a_run_has_rows():
    file = module(Scheme(scenes.get("kepler"), midpoint))
    state = file.begin()
    xs, mus = file.run(state, 0.01, 10, 5)
    assert xs.shape == mus.shape == (3, 2)
    assert np.array_equal(xs[-1], state.x)
    assert file.step(state, 0.02) is state


@pytest.mark.parametrize(("system", "other"), [
    (scenes.get("pendulum"), {"gravity": 2, "mass": 3}),
    (scenes.get("rigid-body"), {"inertia": [3, 1, 2]}),
    (chain(mass=np.array([1.0, 2.0, 3.0, 4.0])), {"mass": [2.0, 1.0, 5.0, 1.0], "stiffness": 3}),
])  # fmt: skip
def test_parameters_stay_parameters(system, other):
    if isinstance(system, Lattice):
        changed = chain(**{**other, "mass": np.array(other["mass"])})
    else:
        changed = system.with_values(parameters=other)
    file = module(Scheme(system, midpoint))
    alike(file, Scheme(changed, midpoint), **other)
    with pytest.raises(TypeError, match="there is no parameter wieght"):
        file.begin(wieght=2.0)


@pytest.mark.dear("top]", "double")
@pytest.mark.parametrize("name", ["double-pendulum", "heavy-top", "kapitza-pendulum",
                                  "lotka-volterra", "mathews-lakshmanan"])  # fmt: skip
def test_energy_and_momenta_are_those_of_the_bench(name):
    scene = scenes.get(name)
    rule = get("implicit-midpoint") if scene.one_form else midpoint
    scheme = Scheme(scene, rule)
    file = module(scheme)
    run = scheme.flow(scene.step).trajectory(3)
    system = system_of(Case("energy", scene, rule, 16))
    wanted, terms = system.energy(run)
    for k, (x, mu) in enumerate(zip(run.base, run.mu, strict=True)):
        state = file.begin(list(x), list(mu))
        assert abs(file.energy(state) - wanted[k]) <= 1e-14 * terms[k]
    if file.QUANTITIES:
        assert len(file.momenta(state)) == len(file.QUANTITIES)
        assert np.isfinite(file.momenta(state)).all()


def test_a_step_may_change_its_size_and_the_order_stays():
    """Halving the step in the middle of a run is the run of both parts."""
    scheme = Scheme(scenes.get("double-pendulum"), midpoint)
    file, state = module(scheme), None
    state = file.begin()
    file.run(state, 0.02, 10)
    xs, _ = file.run(state, 0.01, 10)
    first = scheme.flow("0.02").trajectory(10)
    second = scheme.flow("0.01").trajectory(10, x0=first.x[-1], mu0=first.mu[-1])
    assert abs(xs[-1] - second.x[-1]).max() < 1e-13


@pytest.mark.parametrize(("system", "x", "mu"), [
    (scenes.get("kepler"), [0.0, 0.0], [0.0, 0.0]),  # where the force is infinite
    (chain(), [math.inf, 0.0, 0.0, 0.0], [0.0] * 4),
    (turned("lagrange-top"), [0.0, 0.0, 1.0], [math.inf, 1.0, 1.0]),  # Stumpff's series ends
])  # fmt: skip
def test_a_failed_step_leaves_the_state_as_it_was(system, x, mu):
    file = module(Scheme(system, midpoint))
    state = file.begin(x, mu)
    with pytest.raises(file.StepFailed, match=r"no number|converge"):
        file.step(state, 0.01)
    assert (state.x, state.mu) == (x, mu)
    state.x[:], state.mu[:] = file.X0, file.MU0
    assert math.isfinite(file.step(state, 0.01).x[0])


@pytest.mark.slow
def test_stumpff_s_functions_are_their_series():
    """From z/4ⁿ, near 0 and on both sides of it, against the sums with 40 digits."""
    scene = scenes.get("rigid-body").with_retraction(retractions.get("exponential"))
    file = vars(module(Scheme(scene, midpoint)))
    (name,) = (e for e in file if re.fullmatch(r"stumpff_\d+", e))
    with mpmath.workdps(60):
        for z in (0.0, 1e-9, 0.7, 1.0, 3.0, 30.0, -0.5, -20.0):
            found = [0.0] * (1 + int(name.partition("_")[2]))
            file[name](found, z)
            for k, value in enumerate(found):
                wanted = mpmath.nsum(lambda n, k=k, z=z: (-mpmath.mpf(z))**n
                                     / mpmath.factorial(2 * n + k), [0, mpmath.inf])  # fmt: skip
                assert abs(value - wanted) < 1e-14 * max(abs(wanted), 1 / math.factorial(k)), (k, z)


def test_stages_that_do_not_contract_are_left_to_newton_s_method():
    """With a step as long as the motion's time the sweeps diverge, in the flow and in the file."""
    scene = scenes.get("kepler")
    scheme = Scheme(scene, get("gauss-3"))
    file, run = module(scheme), scheme.flow("0.8").trajectory(40)
    assert "Newton in" in run.solver
    state = file.begin()
    xs, _ = file.run(state, 0.8, 40)
    assert state.stretch > 64
    assert abs(xs - run.x).max() < 1e-9


def test_multipliers_are_those_of_the_run():
    """The end of a step has λh²/2 in it, so that ε of x are 2ε/h² of λ: eight times that."""
    scheme = Scheme(scenes.get("cartesian-pendulum"), trapezoidal)
    file, run = module(scheme), scheme.flow("0.01").trajectory(5)
    state = file.begin()
    for k in range(5):
        file.step(state, 0.01)
        assert abs(file.multipliers(state) - run.multipliers[k]).max() < 8 * 2.0**-53 * 2 / 0.01**2
    assert not hasattr(module(Scheme(scenes.get("pendulum"), trapezoidal)), "multipliers")


#: of lattices: explicit, with the adjoint, by elimination along a chain and round a ring, site by
#: site, with the time, compositions, stages; some with fixed ends. By the exponential map, with
#: Stumpff's functions and with functions of matrices. With names of parameters that a file has
RUNS = [
    (chain(bonds="ring"), "suzuki:rectangle"), (chain(fixed=[0, 3]), "midpoint"),
    *(pytest.param(*e, marks=pytest.mark.slow) for e in (
        (chain(), "trapezoidal"), (chain(bonds="ring"), "midpoint"),
        (chain(), "triple-jump:gauss-2"),
        (chain(bonds=[(0, 1), (0, 2), (2, 3), (1, 3)]), "midpoint"),
        (chain(force=lambda x, v, p, t: [sympy.cos(2 * t) - v[0] / 8]), "midpoint"),
        (chain(), "gauss-2"), (chain(bonds="ring"), "gauss-3"), (turned("heavy-top"), "midpoint"),
        (turned("sl2"), "gauss-3"), (turned("kirchhoff"), "midpoint"), (SL3, "midpoint"),
        (OWN, "midpoint"),
    )),
]  # fmt: skip


@pytest.mark.parametrize(("system", "rule"), RUNS)
def test_a_file_runs_as_its_flow(system, rule):
    alike(module(Scheme(system, get(rule))), Scheme(system, get(rule)))


def alike(file, scheme, **parameters):
    """Assert that a run of a file is that of a scheme to round-off."""
    system = getattr(scheme, "lattice", None) or scheme.scene
    run = scheme.flow(system.step).trajectory(20)
    x, mu = (e.reshape(21, -1) for e in (getattr(run, "base", run.x), run.mu))
    start = np.concatenate([x[0], [0.0] * (file.N - x.shape[1])]), mu[0]  # the time comes last
    xs, mus = file.run(file.begin(*start, **parameters), float(system.step), 20)
    for found, wanted in ((xs[:, : x.shape[1]], x), (mus, mu)):
        assert abs(found - wanted).max(initial=0) <= 64 * 2.0**-53 * abs(wanted).max(initial=1)


@pytest.mark.parametrize("rule", [trapezoidal, midpoint])
def test_a_lattice_has_loops_whose_text_does_not_grow_with_its_sites(rule):
    lines = {sites: Scheme(chain(sites), rule).export("c").count("\n") for sites in (20, 40)}
    assert lines[20] + 4 >= lines[40] - 40 // 4  # but for the start, some entries a line


@black_box(order=1)
def euler(q, p, h, system):
    return q + h * system.velocity(q, p), p - h * system.gradient(q, p)


@pytest.mark.parametrize(("scene", "rule", "said"), [
    (scenes.get("bouncing-ball"), midpoint, "bouncing-ball has contact"),
    (scenes.get("pendulum"), euler, "euler is a program"),
    (chain(100, constraint=lambda x, y, p: [y[0] - x[0]], x0=[[0]] * 100), trapezoidal,
     "chain has 100 sites, and its bonds have constraints"),
], ids=["contact", "program", "lattice"])  # fmt: skip
def test_what_cannot_be_exported_is_one_sentence_that_says_what_can(scene, rule, said):
    with pytest.raises(BadInput, match=f"{said}.* can\\.$") as error:
        Scheme(scene, rule).export("c")
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_functions_of_matrices_are_not_exported_to_jax():
    with pytest.raises(BadInput, match=r"functions of matrices.*cayley, it can\.$"):
        Scheme(SL3, midpoint).export("jax")


def test_an_unknown_language_is_bad_input():
    with pytest.raises(BadInput, match='there is no language "fortran"'):
        Scheme(scenes.get("pendulum"), midpoint).export("fortran")
    with pytest.raises(BadInput, match="digits"):
        Scheme(scenes.get("pendulum"), midpoint).export("c", digits=50)


@pytest.mark.parametrize("language", ["c", "numpy", "julia", "jax"])
def test_whole_numbers_that_no_int_holds_are_floats(language):
    """A float in a Lagrangian is a fraction of such numbers, as are a lattice's own parameters."""
    tenth = sympy.Rational(0.1)
    scene = Scene(name="fine", groupoid=pair(1), parameters={}, x0=[1], v0=[0], duration=1,
                  lagrangian=lambda x, v, p: v[0] ** 2 / 2 - tenth * x[0] ** 4)  # fmt: skip
    text = re.sub(r"seal \w+", "", Scheme(scene, trapezoidal).export(language))
    assert not re.search(r"(?<![\d.e])\d{11,}(?![\d.e])", text)


def in_jax(scheme):
    pytest.importorskip("jax", reason="pip install jax")
    found = types.ModuleType("exported")
    exec(scheme.export("jax"), vars(found))
    return found


#: explicit, Newton's, stages, compositions, a group by both retractions, forces, one-step maps
IN_JAX = [
    ("heavy-top", "midpoint", "cayley"), *(pytest.param(*e, marks=pytest.mark.slow) for e in (
        ("pendulum", "gauss-2", None), ("kepler", "rectangle", None), ("sl2", "midpoint", None),
        ("double-pendulum", "midpoint", None), ("rigid-body", "midpoint", "exponential"),
        ("henon-heiles", "triple-jump:trapezoidal", None), ("pendulum", "suzuki:rectangle", None),
        ("damped-pendulum", "midpoint", None), ("rigid-body", "rkmk-4", None),
    )),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "rule", "retraction"), IN_JAX)
def test_in_jax_a_run_is_the_flow_s_and_its_derivative_that_of_the_flow(scene, rule, retraction):
    system = scenes.get(scene)
    if retraction:
        system = system.with_retraction(retractions.get(retraction))
    scheme = Scheme(system, get(rule))
    file, flow = in_jax(scheme), scheme.flow(scenes.get(scene).step)
    import jax

    run, h = flow.trajectory(10), float(flow.step)

    def end(z):
        last, _ = file.run(file.begin(z[: file.N], z[file.N :]), h, 10)
        return jax.numpy.concatenate([last.x, last.mu])

    z = np.concatenate([run.x[0], run.mu[0]])
    wanted = np.concatenate([run.x[-1], run.mu[-1]])
    assert abs(end(z) - wanted).max() < 1e-13
    exact = flow.derivatives(run).start[-1]
    assert abs(jax.jit(jax.jacfwd(end))(z) - exact).max() < 1e-12
    assert abs(jax.jit(jax.jacrev(end))(z) - exact).max() < 1e-12
    several = jax.vmap(end)(np.stack([z, 1.01 * z]))
    assert abs(several[0] - wanted).max() < 1e-13


def test_in_jax_parameters_have_derivatives_and_a_failed_step_is_nan():
    scheme = Scheme(scenes.get("pendulum"), midpoint)
    file, flow = in_jax(scheme), scheme.flow("0.1")
    import jax

    def end(gravity):
        return file.run(file.begin(gravity=gravity), 0.1, 5)[0].mu[0]

    exact = flow.derivatives(flow.trajectory(5)).parameters["gravity"][-1]
    assert abs(float(jax.grad(end)(1.0)) - exact[1]) < 1e-12
    assert not np.isfinite(file.step(file.begin(), np.inf).x).any()
    assert np.isfinite(file.energy(file.begin()))


@pytest.mark.dear("gauss-3")
@pytest.mark.parametrize(("scene", "rule"), [
    ("double-pendulum", "gauss-2"), ("pendulum", "suzuki:rectangle"), ("rolling-disc", "midpoint"),
    ("pendulum", "gauss-3"), (None, "midpoint"),
])  # fmt: skip
def test_julia_is_sound_as_text(scene, rule):
    """There is no Julia here: its grammar is checked, the ends of blocks, indices from 1."""
    text = Scheme(scenes.get(scene) if scene else chain(), get(rule)).export("julia", True)
    code = re.sub(r'#=.*?=#|"[^"\n]*"|#[^\n]*', "", text, flags=re.S)
    words = r"^\s*(?:mutable struct|module|function|for|while|if)\b|= try$"
    opened = re.findall(words, code, re.M)
    assert len(opened) == len(re.findall(r"^\s*end\b", code, re.M))
    assert not re.search(r"[A-Za-z_]\w*\[0\]", code)
    parser = pytest.importorskip("tree_sitter", reason="pip install tree-sitter tree-sitter-julia")
    grammar = pytest.importorskip("tree_sitter_julia", reason="pip install tree-sitter-julia")
    julia = parser.Parser(parser.Language(grammar.language()))
    assert not julia.parse(text.encode()).root_node.has_error
    assert julia.parse(text.replace("[1]", "[1", 1).encode()).root_node.has_error
