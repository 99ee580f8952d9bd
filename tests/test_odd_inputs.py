"""Odd inputs of every kind, at random: the answer is an exception of ours, or it works."""

import contextlib
import os
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import sympy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import discmech
from discmech.integrators.errors import DiscmechError, shown
from discmech.reference import ReferenceFailure
from tests import odd_commands

OURS = (DiscmechError, ReferenceFailure)
X = sympy.Symbol("x")
MANY, NONE = (sympy.Pow(10, n * 10**7, evaluate=False) for n in (1, -1))  # and as many zeros

numbers = st.one_of(
    st.integers(-3, 3), st.integers(), st.sampled_from([30, 400, 5000]).map(lambda k: 10**k),
    st.floats(), st.fractions(), st.complex_numbers(), st.booleans(),
    st.sampled_from([np.float32(1.5), np.int64(3), np.array(1.0), np.bool_(True)]),
    st.sampled_from([sympy.pi, sympy.I, sympy.oo, sympy.nan, sympy.sqrt(2), X, sympy.Integer(2)]),
    st.sampled_from([NONE, MANY, sympy.factorial(10**8, evaluate=False), sympy.exp(10**9)]),
)  # fmt: skip
words = st.one_of(
    st.text(max_size=20),
    st.sampled_from(["1/3", "0.1", "1e999999", "nan", "-", "__class__", "a b"]),
)
others = st.one_of(
    st.none(), st.binary(max_size=5), st.sampled_from([object(), int, len, ..., {}, set(), b""]),
    st.sampled_from([sympy.Matrix([[1, 2]]), sympy.Function("f")(X), sympy.floor(X), X > 0]),
    st.sampled_from([np.zeros(3), np.zeros((2, 2)), np.array([None]), np.array(["a"])]),
)  # fmt: skip
odd = st.recursive(
    st.one_of(numbers, words, others),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(words, inner, max_size=2)),
    max_leaves=4,
)


def kinetic(x, v, p):
    return v[0] ** 2 / 2 - x[0] ** 2 / 2


def scene(**changes):
    given_too = {"name": "odd", "groupoid": discmech.pair(1), "lagrangian": kinetic,
                 "x0": [1], "v0": [0], "duration": 1}  # fmt: skip
    return discmech.Scene(**given_too | changes)


def run(a_scene, rule=discmech.midpoint, step="1/10", digits=16, steps=2, **start):
    return discmech.Scheme(a_scene, rule).flow(step, digits).trajectory(steps, **start)


def rule_giving(value):
    return discmech.discretisation(name="odd")(lambda L, G, x, u, h: value)


def mapped(value, **how):
    formula = (lambda s, z, Z, h: value) if how.get("implicit") else (lambda s, z, h: value)
    stages = (lambda s, z, h, K: value) if how.get("stages") else formula
    return run(scene(), discmech.one_step(name="odd", **how)(stages))


def _none(v):
    """An empty list asks for everything."""
    return isinstance(v, list | tuple | dict | set) and not v


def pushed(x, v, p, t):
    return [t - v[0]]


FLOW = discmech.Scheme(scene(), discmech.midpoint).flow("1/10")
TIMED = discmech.Scheme(scene(force=pushed), discmech.midpoint).flow("1/10")
GIVEN = {"lagrangian": None, "discrete_lagrangian": lambda x, u, h, p: h * u[0] ** 2 / 2}
PLACES = {
    **{f"scene {name}": lambda v, name=name: scene(**{name: v})
       for name in ("name", "groupoid", "parameters", "x0", "v0", "duration", "step",
                    "symmetries")},
    "parameter": lambda v: scene(parameters={"a": v}),
    "lagrangian": lambda v: run(scene(lagrangian=v)),
    "value of a lagrangian": lambda v: run(scene(lagrangian=lambda x, u, p: v)),
    "term of a lagrangian": lambda v: run(scene(lagrangian=lambda x, u, p: kinetic(x, u, p) + v)),
    "value of a rule": lambda v: run(scene(), rule_giving(v)),
    "conserved": lambda v: scene(symmetries=[discmech.Conserved("J", v)]),
    "pair": lambda v: discmech.pair(v), "so": lambda v: discmech.so(v),
    "se": lambda v: discmech.se(v), "lie_group": lambda v: discmech.lie_group(v),
    "action": lambda v: discmech.action(v),
    "retraction": lambda v: discmech.lie_group(discmech.so(3), v),
    "product": lambda v: discmech.product(v, discmech.pair(1)),
    "target": lambda v: discmech.Scheme(scene(groupoid=discmech.LocalGroupoid(
        1, 1, target=lambda x, u, h: v, product=lambda x, u, w, h: [u[0] + w[0]])),
        discmech.midpoint).rho,
    "dimension": lambda v: discmech.LocalGroupoid(
        v, 1, target=lambda x, u, h: x, product=lambda x, u, w, h: u),
    "basis": lambda v: discmech.MatrixAlgebra("a", v),
    "order of a rule": lambda v: discmech.discretisation(order=v)(lambda L, G, x, u, h: 0),
    "rule": lambda v: discmech.Scheme(scene(), v), "scene": lambda v: discmech.Scheme(v, None),
    "step of a flow": lambda v: discmech.Scheme(scene(), discmech.midpoint).flow(v),
    "digits": lambda v: discmech.Scheme(scene(), discmech.midpoint).flow("1/10", v),
    "steps": lambda v: FLOW.trajectory(v) if not isinstance(v, int) or v < 100 else None,
    "every": lambda v: FLOW.trajectory(3, v),
    "start x": lambda v: FLOW.trajectory(1, x0=v, mu0=[1]),
    "start mu": lambda v: FLOW.trajectory(1, x0=[1], mu0=v),
    "evolve": lambda v: FLOW.evolve(v, [1]), "devolve": lambda v: FLOW.devolve([1], v),
    "defect": lambda v: FLOW.pullback_defect([1], v),
    "poisson": lambda v: FLOW.poisson_defect(v, [1]),
    **{name: lambda v, name=name: scene(**{name: v})
       for name in ("force", "holonomic", "nonholonomic")},
    **{f"value of {name}": lambda v, name=name: run(scene(**{name: lambda x, *more: v}))
       for name in ("holonomic", "nonholonomic")},
    "value of a force": lambda v: run(scene(force=lambda x, u, p, t: v)),
    "entry of a force": lambda v: run(scene(force=lambda x, u, p: [v])),
    "row of nonholonomic": lambda v: run(scene(nonholonomic=lambda x, p: [v])),
    "mu0": lambda v: run(scene(**GIVEN, mu0=v), discmech.integrators.rules.own),
    "t0": lambda v: TIMED.trajectory(1, t0=v),
    "time in x0": lambda v: TIMED.trajectory(1, x0=[1, v], mu0=[1]),
    "x0 with its time": lambda v: TIMED.trajectory(1, x0=v, mu0=[1], t0="1/2"),
    **{f"ensemble {name}": lambda v, name=name: FLOW.ensemble(
        **{"x0s": [[1], [2]], "mu0s": [[1], [1]], "steps": 2} | {name: v})
       for name in ("x0s", "mu0s", "every", "u0", "t0")},
    "value of a map": mapped, "implicit map": lambda v: mapped(v, implicit=True),
    "stages of a map": lambda v: mapped(v, stages=1),
    "residual of a stage": lambda v: mapped((sympy.Matrix([1, 1]), [v]), stages=1),
    **{f"{name} of a map": lambda v, name=name: discmech.one_step(**{name: v})(
        lambda s, z, h: z) for name in ("order", "implicit", "stages", "groupoids", "name")},
    "check study": lambda v: discmech.check(v, ["harmonic"], ["midpoint"], [16], 8),
    "check scene": lambda v: _none(v) or discmech.check("order", v, ["midpoint"], [16], 8),
    "check rule": lambda v: _none(v) or discmech.check("order", ["harmonic"], v, [16], 8),
    "reference scene": lambda v: discmech.solution(v, 1, digits=20),
    "reference time": lambda v: discmech.solution("harmonic", v, digits=20),
    "reference digits": lambda v: (
        None if isinstance(v, int) and v > 100 else discmech.solution("harmonic", 1, digits=v)),
}  # fmt: skip
CHAIN = {"name": "odd", "site": discmech.pair(1), "sites": 3, "x0": np.ones((3, 1)),
         "on_site": kinetic, "on_bond": lambda x, y, p: -((y[0] - x[0]) ** 2),
         "v0": np.zeros((3, 1))}  # fmt: skip


def lattice(**changes):
    return discmech.Lattice(**CHAIN | changes)


def run_lattice(a_lattice=None, rule=discmech.midpoint, step="1/10", steps=2, every=1, **more):
    flow = discmech.Scheme(a_lattice or lattice(), rule).flow(step)
    return flow.trajectory(steps, every, **more)


def touching(**changes):
    return scene(**{"contact": lambda x, p: [x[0] + 3], "friction": "1/10"} | changes)


def control(**changes):
    given_too = {"scene": scene(), "cost": lambda x, v, f, p: f.dot(f), "end": ([0], [0])}
    return discmech.Control(**given_too | changes)


def small(v):
    """Whether a number of steps or sites is no hour's work."""
    return not isinstance(v, int | np.integer) or v < 100


PLACES |= {
    **{f"lattice {name}": lambda v, name=name: lattice(**{name: v})
       for name in ("name", "site", "parameters", "on_site", "on_bond", "bonds", "x0", "v0",
                    "duration", "step", "fixed_ends", "fixed", "constraint", "contact",
                    "restitution", "symmetries")},
    "lattice sites": lambda v: lattice(sites=v) if small(v) else None,
    "sites beyond memory": lambda v: lattice(sites=v) if isinstance(v, int) and v > 10**20 else 0,
    **{f"value of {name} of a lattice": lambda v, name=name: run_lattice(
        lattice(**{name: lambda *given: v})) for name in ("on_site", "on_bond", "contact",
                                                          "constraint")},
    "step of a lattice": lambda v: run_lattice(step=v),
    "steps of a lattice": lambda v: run_lattice(steps=v) if small(v) else None,
    "every of a lattice": lambda v: run_lattice(every=v),
    **{f"{name} of a lattice's run": lambda v, name=name: run_lattice(**{name: v})
       for name in ("x0", "mu0", "progress")},
    "checkpoint": lambda v: isinstance(v, str | bytes) or run_lattice(checkpoint=v),
    "rule of a lattice": lambda v: run_lattice(rule=v),
    **{f"contact {name}": lambda v, name=name: run(touching(**{name: v}))
       for name in ("contact", "friction", "restitution", "impacts")},
    "value of contact": lambda v: run(touching(contact=lambda x, p: v)),
    "gap": lambda v: run(touching(contact=lambda x, p: [v])),
    "plane of a gap": lambda v: run(touching(contact=lambda x, p: [(x[0] + 3, v)])),
    **{f"control {name}": lambda v, name=name: control(**{name: v})
       for name in ("scene", "cost", "end", "inputs", "controls", "duration", "path")},
    "value of a cost": lambda v: control(cost=lambda x, u, f, p: v).solve(3),
    "value of inputs": lambda v: control(inputs=lambda x, u, f, p: v, controls=1).solve(3),
    "value of a path": lambda v: control(path=lambda t: v).solve(3),
    "steps of a control": lambda v: control().solve(v) if small(v) else None,
    "rule of a control": lambda v: control().solve(2, v),
    "tolerance": lambda v: discmech.Scheme(scene(), discmech.midpoint).flow(tolerance=v),
    "progress": lambda v: FLOW.trajectory(2, progress=v),
    "row of an arrow": lambda v: FLOW.arrow(FLOW.trajectory(2), v),
    "run of an arrow": lambda v: FLOW.arrow(v, 0), "elements": lambda v: FLOW.elements(v),
    **{f"conserved {name}": lambda v, name=name: scene(symmetries=[
        discmech.Conserved(**{"name": "J", "formula": lambda x, mu, p: mu[0], name: v})])
       for name in ("name", "kind", "attitude", "value", "stretch")},
    **{f"reference {name}": lambda v, name=name: discmech.solution(
        "harmonic", 1, **{"digits": 20, name: v}) for name in ("attitude", "proof")},
    "value of a referred force": lambda v: discmech.solution(
        scene(force=lambda x, u, p: [v]), "1/2", digits=20),
    "value of a referred lagrangian": lambda v: discmech.solution(
        scene(lagrangian=lambda x, u, p: kinetic(x, u, p) + v), "1/2", digits=20),
    "nodes of a rule": lambda v: [discmech.integrators.rules.gauss(v),
                                  discmech.integrators.rules.lobatto(v)],
    "name of a rule": lambda v: discmech.integrators.rules.get(v),
    "newmark": lambda v: discmech.integrators.rules.newmark(v, v),
}  # fmt: skip
CLAIMS = ("order", "symplectic", "reversible", "keeps", "state", "runs", "numbers", "jacobian",
          "gradient", "scalar",
          "vectorised", "read", "write", "name", "source", "groupoids")  # fmt: skip
RUN = "t,q1,p1\n" + "".join(f"{k / 10},{1 - k**2 / 200},{-k / 10}\n" for k in range(12))


def boxed(step=lambda q, p, h: (q + h * p, p - h * q), steps=2, **claims):
    return run(scene(), discmech.black_box(**claims)(step), steps=steps)


def read(content=RUN, order=2, **claims):
    """A run in a file of the current folder, asked as a rule."""
    content = content if isinstance(content, bytes) else content.encode("utf-8", "replace")
    Path("run.csv").write_bytes(content)
    files = Path("run.csv").resolve()
    flow = discmech.Scheme(scene(), discmech.recorded(files, order, **claims)).flow("1/10")
    return flow.trajectory(2)


def cell(v):
    """A run of which one number is something else."""
    return read(RUN.replace("-0.5", shown(v), 1))


def resumed(v, name):
    """A lattice that goes on from files of which one was changed."""
    for file in Path(".").glob("kept.npz*"):
        file.unlink()
    flow = discmech.Scheme(lattice(), discmech.midpoint).flow("1/10")
    flow.trajectory(2, checkpoint="kept.npz")
    Path(name).write_bytes(v if isinstance(v, bytes) else shown(v).encode("utf-8", "replace"))
    return flow.trajectory(4, checkpoint="kept.npz")


def named(v):
    """A checkpoint of that name in the current folder."""
    if not isinstance(v, str) or (v.isprintable() and not set(v) & set("/.")):
        run_lattice(checkpoint=v)


PLACES |= {
    **{f"{word} of a black box": lambda v, word=word: boxed(**{word: v}) for word in CLAIMS},
    "black box": lambda v: run(scene(), discmech.black_box()(v)),
    "value of a black box": lambda v: boxed(lambda q, p, h: v),
    "q of a black box": lambda v: boxed(lambda q, p, h: (v, p)),
    "p of a black box": lambda v: boxed(lambda q, p, h: (q, [v])),
    "whole run of a black box": lambda v: boxed(
        lambda q, p, h, steps, every: (v, [p] * 3), runs=True),
    **{f"{word} of a recorded run": lambda v, word=word: read(**{word: v})
       for word in ("order", "name", "state", "scene", "symplectic")},
    "recorded run": lambda v: read(v) if isinstance(v, str | bytes) else cell(v),
    "number of a recorded run": cell,
    "command of a program": lambda v: discmech.external(v, seconds=1, restarts=0),
    "seconds of a program": lambda v: discmech.external(["true"], seconds=v),
    **{f"{name}, on which a run goes on": lambda v, name=name: resumed(v, name)
       for name in ("kept.npz", "kept.npz.x.npy")},
    "name of a checkpoint": named,
    "plot": discmech.plot, "kind of a plot": lambda v: discmech.plot(FLOW.trajectory(2), v),
    "labels of a plot": lambda v: discmech.plot(FLOW.trajectory(2), labels={"midpoint": v}),
    "style of a plot": lambda v: discmech.plot(FLOW.trajectory(2), style=v),
    "explained scene": lambda v: discmech.explain(v, "midpoint"),
    "explained rule": lambda v: discmech.explain("harmonic", v), "shown": discmech.show,
    "value on the way of a lagrangian": lambda v: run(
        scene(lagrangian=lambda x, u, p: kinetic(x, u, p) + x[0] * v), steps=20),
    "power of a lagrangian": lambda v: run(
        scene(lagrangian=lambda x, u, p: kinetic(x, u, p) - x[0] ** 4 * v), step=1, steps=30),
}  # fmt: skip
SETTINGS = settings(
    deadline=None, suppress_health_check=list(HealthCheck), print_blob=True,
    max_examples=int(os.environ.get("DISCMECH_ODD_INPUTS", "150")),
)  # fmt: skip


def ends_well(found):
    """What was found holds no numbers that are none: these are told, never given back."""
    for name in ("x", "mu"):
        held = getattr(found, name, None)
        if isinstance(held, np.ndarray):
            assert np.isfinite(held.astype(float)).all(), (name, held)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("place", PLACES)
def test_odd_values_are_refused_in_our_words(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    @SETTINGS
    @given(odd)
    def ask(value):
        with contextlib.suppress(*OURS):
            ends_well(PLACES[place](value))

    ask()


def test_odd_command_lines_end_with_an_exit_code_of_ours(tmp_path, monkeypatch):
    """A few of those that `python -m tests.odd_commands 10000` asks."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    odd_commands.files(tmp_path / "here")
    found = odd_commands.wrong_lines(20, 2, seconds=2)
    assert found["wrong"] == 0 and found.total()


def _pushed_by(function):
    return scene(force=lambda x, v, p: [function(x)])


SMALLEST = {
    "I x": lambda: discmech.solution(_pushed_by(lambda x: sympy.I * x[0]), "1/2", digits=20),
    "log": lambda: discmech.solution(_pushed_by(lambda x: sympy.log(x[0] - 1)), "1/2", digits=20),
    "pole": lambda: discmech.solution(_pushed_by(lambda x: 1 / (x[0] - 1)), "1/2", digits=20),
    "Max": lambda: discmech.solution(
        scene(lagrangian=lambda x, v, p: sympy.Max(v[0], x[0])), "1/2", digits=20),
    "attitude": lambda: discmech.solution("harmonic", 1, digits=20, attitude=[]),
    "newmark": lambda: discmech.integrators.rules.get("newmark-1e400-1"),
    "duration": lambda: control(duration=10**400).solve(4),
    "tolerance": lambda: discmech.Scheme(scene(), discmech.midpoint).flow(tolerance=10**400),
    "sites": lambda: lattice(sites=10**30),
    "controls": lambda: control(controls=10**5000),
    "a gap of many digits": lambda: run(touching(contact=lambda x, p: 10**5000)),
    "a cost of many digits": lambda: control(cost=lambda x, u, f, p: [10**5000]).solve(3),
    "a cost beyond doubles": lambda: control(cost=lambda x, u, f, p: 10**400).solve(3),
    "inputs beyond doubles": lambda: control(
        inputs=lambda x, u, f, p: [10**400], controls=1).solve(3),
    "a bond beyond doubles": lambda: run_lattice(lattice(constraint=lambda *given: [10**400])),
    "a step in a list": lambda: run_lattice(step=[10**5000]),
    "not a run": lambda: FLOW.arrow([1], 0),
    "progress": lambda: FLOW.trajectory(2, progress=3),
    "residuals": lambda: mapped((sympy.Matrix([1, 1]), X), stages=1),
    "kind": lambda: discmech.Conserved("J", kinetic, kind=np.zeros(2)),
    **{f"{n} in {where}": lambda n=n, ask=ask: ask(sympy.sympify(n, evaluate=False))
       for n in ("10**(10**7)", "1/10**(10**9)", "2**(2**30)", "factorial(10**7)",
                 "binomial(10**9, 10**8)", "exp(exp(100))")
       for where, ask in {
           "a lagrangian": lambda n: run(scene(
               lagrangian=lambda x, v, p: kinetic(x, v, p) - n * x[0])),
           "a parameter": lambda n: scene(parameters={"a": n}),
           "a reference": lambda n: discmech.solution(scene(
               lagrangian=lambda x, v, p: kinetic(x, v, p) - n * x[0]), "1/2", digits=20),
           "a map": lambda n: mapped(n), "a start": lambda n: scene(x0=[n]),
       }.items()},
}  # fmt: skip


@pytest.mark.parametrize("name", SMALLEST)
def test_the_smallest_calls_that_failed_otherwise(name):
    with pytest.raises(OURS):
        SMALLEST[name]()


def test_our_exceptions_are_told_from_others():
    with pytest.raises(ZeroDivisionError), contextlib.suppress(*OURS):
        Fraction(1, 0)
