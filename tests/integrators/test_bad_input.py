"""Bad input: each kind is refused in one sentence that names the thing and the mend."""

import math
from dataclasses import replace
from functools import reduce

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import (
    BadInput,
    Conserved,
    DiscmechError,
    LocalGroupoid,
    Scene,
    Scheme,
    action,
    black_box,
    discretisation,
    lie_group,
    midpoint,
    one_step,
    pair,
    product,
    scenes,
    sl,
    so,
)
from discmech.integrators.equations import SceneSymbols
from discmech.integrators.errors import check_function
from discmech.integrators.extensions.control import Control
from discmech.integrators.extensions.lattices import Lattice
from discmech.integrators.groupoids import check_axioms
from discmech.integrators.numbers import code
from discmech.integrators.rules import get as rule_called
from tests.objects import SCENES, flow, scheme

NAN, INF = float("nan"), float("inf")
Z = sympy.Symbol("z")


def kinetic(x, v, p):
    return v[0] ** 2 / 2


def half(digits):
    """1/2 with more digits than doubles ask for, and 1/2 + 10⁻⁹ in doubles."""
    return mpmath.mpf("0.5") + (mpmath.mpf("1e-9") if digits < 40 else 0)


def of_constant(number):
    """Run a rule at a point of the step that this number gives."""
    made = discretisation(order=2, name="by-digits")(
        lambda L, G, x, u, h: h * L(G.target(x, u, h * G.constant(number)), u))  # fmt: skip
    return Scheme(plain(), made).flow("0.1").trajectory(1)


def plain(**changes):
    return Scene(**{"name": "bad", "groupoid": pair(1), "lagrangian": kinetic,
                    "x0": [1], "v0": [0], **changes})  # fmt: skip


def plane(**changes):
    return plain(groupoid=pair(2), x0=[0, 0], v0=[0, 0], **changes)


def with_lagrangian(lagrangian, **changes):
    return Scheme(plain(lagrangian=lagrangian, **changes), midpoint)


def with_rule(formula):
    return Scheme(plane(), discretisation(name="mine")(formula))


def pendulum():
    return flow("pendulum", "midpoint", "1/20")


def top(**changes):
    return Scheme(SCENES["heavy-top"].with_values(**changes), midpoint)


CASES = {
    # shapes and numbers of a scene
    "x0 too long": (lambda: plain(x0=[1, 2]), "bad: x0 has 2 entries, but 1 are needed"),
    "x0 missing": (lambda: Scene("bad", pair(1), kinetic, v0=[0]),
                   "bad has no start: give x0=, a list of 1 numbers"),
    "v0 too short": (lambda: plane(lagrangian=kinetic, parameters={}).with_values(v0=[1]),
                     "bad: v0 has 1 entries, but 2 are needed"),
    "x0 no list": (lambda: plain(x0=1), "x0 is 1: give a list of 1 numbers"),
    "x0 a text": (lambda: plain(x0="1"), "x0 is '1': give a list"),
    "x0 on a group": (lambda: SCENES["rigid-body"].with_values(x0=[1]), "x0 has 1 entries, but 0"),
    "nan": (lambda: plain(x0=[NAN]), r"bad: x0\[0\] is nan: give a finite number"),
    "inf": (lambda: plain(v0=[INF]), r"bad: v0\[0\] is inf: give a finite number"),
    "nan in an array": (lambda: plain(x0=np.array([NAN])), r"x0\[0\] is nan"),
    "no number": (lambda: plain(x0=["one"]), r'x0\[0\] is "one", which is no number: write'),
    "parameter nan": (lambda: plain(parameters={"a": NAN}), "parameter a is nan"),
    "parameter list": (lambda: plain(parameters={"a": [1, NAN]}), r"parameter a\[1\] is nan"),
    "parameter name": (lambda: plain(parameters={"a b": 1}), "parameter 'a b' is no name"),
    "parameter of Python": (lambda: plain(parameters={"__class__": 1}), "'__class__' begins with"),
    "name of many digits": (lambda: rule_called("gauss-" + "9" * 5000), "no rule .*gauss-99"),
    "map of many digits": (lambda: rule_called("dual-gauss-" + "9" * 5000), "no rule .*dual-gauss"),
    "composed of many digits": (lambda: rule_called("kahan-li-8:lobatto-" + "9" * 5000), "no rule"),
    "name": (lambda: plain(name="a/b"), "scene's name is 'a/b': use letters, .* in name="),
    "name of a rule": (lambda: discretisation(1, name="a b")(lambda L, G, x, u, h: 0),
                       "rule's name is 'a b': use letters, .* in name="),
    "name of a lattice": (lambda: Lattice("a b", pair(1), kinetic, kinetic),
                          "lattice's name is 'a b': use letters, .* in name="),
    "name of a box": (lambda: black_box(name="a b")(lambda q, p, h: (q, p)),
                      "black box's name is 'a b': use letters, .* in name="),
    "groupoid": (lambda: plain(groupoid="pair"), r"groupoid is 'pair'; give pair\(n\)"),
    "no Lagrangian": (lambda: plain(lagrangian=None), "either lagrangian= or discrete_lagr"),
    "two Lagrangians": (lambda: plain(discrete_lagrangian=kinetic), "give either lagrangian="),
    "a constant that is another number in doubles": (
        lambda: of_constant(half),
        "constant half is off by 1e-09 if 36 digits"),
    **{f"a constant {word}": (lambda f=given: of_constant(f), said) for word, given, said in (
        ("in a lambda", lambda digits: mpmath.mpf(3) ** -digits,
         r'line \d+: the constant "lambda digits: mpmath.mpf\(3\) \*\* \(-digits\)" is off by'),
        ("that is no number", lambda digits: "half",
         r"""line \d+: the constant "lambda digits: 'half'" could not be computed to """),
        ("that is a number", 0.5, r"a constant is 0.5; give a function of \(digits\)"),
    )},
    "duration": (lambda: plain(duration=-1), "bad: duration and step must be positive"),
    "duration inf": (lambda: plain(duration=INF), "bad: duration is inf"),
    "scene's step": (lambda: plain(step=0), "duration and step must be positive"),
    "unknown parameter": (lambda: top(parameters={"mass": 1}),
                          "heavy-top has no parameter 'mass'; it has inertia, weight, center"),
    "parameters no dictionary": (lambda: top(parameters=[1]),
                                 r"heavy-top: parameters is \[1\]; give a dictionary"),
    "constraint raises": (
        lambda: Scheme(
            plain(symmetries=[Conserved("c", lambda x, mu, p: x[5], value=1)]), midpoint),
        "bad: c could not be evaluated with symbols .IndexError"),
    **{f"attitude asked for by {name}": (
        lambda e=energy: Scheme(Scene("turned", lie_group(so(3)), e, v0=[1, 0, 0]), midpoint),
        r"Lagrangian asks for x, which is empty on a Lie group.*with_attitude\(\), where x\[3\*i")
       for name, energy in (
           ("an entry", lambda x, v, p: v.dot(v) / 2 - x[2]),
           ("a sum", lambda x, v, p: v.dot(v) / 2 - x.dot(x)),
           ("a trace", lambda x, v, p, t: v.dot(v) / 2 - t * x.trace()),
           ("an array of one number", lambda x, v, p: np.array(v.dot(v) / 2 - x[2])),
       )},
    "attitude, of a force": (
        lambda: Scheme(Scene("turned", lie_group(so(3)), lambda x, v, p: v.dot(v) / 2,
                             force=lambda x, v, p: [x[0], 0, 0], v0=[1, 0, 0]), midpoint),
        "its force asks for x, which is empty on a Lie group"),
    "attitude, of rows of the velocity": (
        lambda: Scheme(Scene("turned", lie_group(so(3)), lambda x, v, p: v.dot(v) / 2,
                             nonholonomic=lambda x, p: [[x[0], 0, 1]], v0=[1, 0, 0]), midpoint),
        r"its constraint asks for x, which is empty on a Lie group.*take scene.with_attitude\(\)"),
    "x without a base": (
        lambda: Scheme(Scene("turned", product(lie_group(so(3)), lie_group(so(3))),
                             lambda x, v, p: v.dot(v) / 2 + x[0], v0=[1] * 6), midpoint),
        "its Lagrangian asks for x, which is empty on this groupoid.* write it without x"),
    **{f"{name} on a group": (
        lambda given=given: Scheme(Scene("turned", lie_group(so(3)), v0=[1, 0, 0],
                                         **{"lagrangian": lambda x, v, p: v.dot(v), **given}),
                                   midpoint),
        "is None, not an expression in its arguments; does it return")
       for name, given in (
           ("no Lagrangian returned", {"lagrangian": lambda x, v, p: None}),
           ("no force returned", {"force": lambda x, v, p: None}),
           ("no component returned", {"force": lambda x, v, p: [None, 0, 0]}),
       )},
    "force as a formula in quotes": (
        lambda: Scheme(plain(force=lambda x, v, p: ["-v[0]"]), midpoint),
        "its force is the text '-v.0.': a number may be text.* a formula is written without"),
    "force of pieces": (
        lambda: Scheme(plain(force=lambda x, v, p, t: [-v[0] * abs(v[0])]), midpoint),
        "the force of bad holds Abs .or Max.* A switch can be smooth"),
    "attitude": (lambda: plain().with_attitude(), "only a scene on a Lie group has an attitude"),
    # Lagrangians
    "Lagrangian raises": (lambda: with_lagrangian(lambda x, v, p: 1 / 0),
                          "bad: its Lagrangian could not be evaluated with symbols .*Zero"),
    "numpy": (lambda: with_lagrangian(lambda x, v, p: np.cos(x[0]) * v[0] ** 2),
              "could not be evaluated .* sympy functions: sympy.cos, not numpy's"),
    "index": (lambda: with_lagrangian(lambda x, v, p: v[1]), "IndexError.*; fix it"),
    "a column": (lambda: with_lagrangian(lambda x, v, p: v**2 + sympy.cos(x)), "take an entry"),
    "a column's square": (
        lambda: Scheme(plane(lagrangian=lambda x, v, p: v**2), midpoint), "take an entry"),
    "a caret": (lambda: with_lagrangian(lambda x, v, p: v[0] ^ 2), r"a power is \*\* in Python"),
    "math": (lambda: with_lagrangian(lambda x, v, p: math.cos(x[0])), "such as sympy.cos"),
    "an if": (lambda: with_lagrangian(lambda x, v, p: v[0] if x[0] > 0 else 0), "one smooth form"),
    "arguments": (lambda: with_lagrangian(lambda x, v: v[0]),
                  r"test_bad_input.py, line \d+: bad: lagrangian= .*\(x, v\); write it with"),
    "a force's arguments": (lambda: plain(force=lambda x, v: [0]), r"force= .*\(x, v, p\) or"),
    "a constraint of x, v, p and t": (
        lambda: plain(holonomic=lambda x, v, p, t: [t]), r"with \(x, p\) or \(x, p, t\)\."),
    **{f"an argument that another has the place of: {word}": (
        lambda word=word, f=f: plain(**{word: f}), rf"bad: {word}= is .*, whose {stray}; write it")
       for word, f, stray in (
           ("holonomic", lambda x, v, p: [x[0]], "p would be t"),
           ("holonomic", lambda x, v: [x[0]], "v would be p"),
           ("nonholonomic", lambda x, t, p: [[1]], "t would be p"),
           ("force", lambda x, v, t: [0], "t would be p"),
           ("lagrangian", lambda x, v, t, p: v[0] ** 2, "t would be p"),
           ("lagrangian", lambda t, x, v, p: v[0] ** 2, "t would be x"),
           ("contact", lambda p, x: [x[0]], "p would be x"),
       )},
    "a time in a quantity": (
        lambda: Conserved("J", lambda x, mu, p, t: mu[0]), "J is .*, whose t would be h; write it"),
    "a velocity in a bond": (
        lambda: Lattice("bad", pair(1), 2, on_site=kinetic, on_bond=lambda x, v, p: v[0] ** 2),
        r"on_bond= is a function of \(x, v, p\), whose v would be y; write it with \(x, y, p\)"),
    "a cost in another order": (
        lambda: Control(plain(), lambda x, v, p, f: f[0] ** 2, ([1], [0])),
        r"cost= is a function of \(x, v, p, f\), whose p would be f; write it"),
    **{f"a quantity {words}": (
        lambda f=f: SceneSymbols(plain()).conserved(Conserved("J", f)), rf"bad: J {words}")
       for f, words in (
           (lambda x, mu, p: None, "is None, not an expression"),
           (lambda x, mu, p: mu[5], "could not be evaluated .*IndexError"),
           (lambda x, mu, p: sympy.Symbol("z") * mu[0],
            "holds the unknown symbol z; write it with x, mu, p and h"),
       )},
    "a quantity's arguments": (lambda: Conserved("J", lambda x, v: 0), r"J is .*\(x, mu, p\) or"),
    "p as a dictionary": (lambda: with_lagrangian(lambda x, v, p: p["m"]), "of them is p.name"),
    "forces": (lambda: plain(forces=0), r"Scene\(forces=...\): there is no forces=; say force="),
    "constraint": (lambda: plain(constraint=0), "no constraint=; say holonomic= for"),
    "constraints": (lambda: plain(constraints=0), "constraints= is 0, but is a list of Constraint"),
    "t": (lambda: plain(t=0), "no t=; say lagrangian=lambda x, v, p, t"),
    "h of a flow": (lambda: Scheme(plain(), midpoint).flow(h=1), "no h=; say step="),
    "a lattice in a rule's place": (
        lambda: Scheme(midpoint, Lattice("bad", pair(1), 2, on_site=kinetic, x0=[[0]] * 2,
                                         on_bond=lambda x, y, p: x[0], v0=[[0]] * 2)),
        "midpoint is a rule, where a scene is asked for: swap the two"),
    "a class for a lattice": (lambda: Scheme(Lattice, midpoint), "Lattice is no scene: give a S"),
    "a word of a lattice's run": (
        lambda: Scheme(Lattice("bad", pair(1), 2, on_site=kinetic, x0=[[0]] * 2, v0=[[0]] * 2,
                               on_bond=lambda x, y, p: x[0]), midpoint).flow(1).trajectory(1, u0=1),
        r"trajectory\(u0=...\): there is no u0=; say mu0="),
    "t of a run": (lambda: Scheme(plain(), midpoint).flow(1).trajectory(t=1), "no t=; say steps="),
    "an unknown field": (lambda: plain(colour=0), "no colour=; it has name, groupoid"),
    "parameter not there": (
        lambda: with_lagrangian(lambda x, v, p: p.width * v[0], parameters={"length": 1}),
        "asks for what is not there .*width.*the parameters are: length"),
    "a vector": (lambda: Scheme(plane(lagrangian=lambda x, v, p: v), midpoint),
                 r"its Lagrangian is a matrix \(2, 1\), not a number"),
    "a strange symbol": (lambda: with_lagrangian(lambda x, v, p: sympy.Symbol("m") * v[0]),
                         r"line \d+: bad: its Lagrangian holds the unknown symbol m; write"),
    "a symbol that a rule's constants have": (
        lambda: Scheme(plain(lagrangian=lambda x, v, p: (
            v[0] ** 2 / 2 - sympy.Symbol("gn0", real=True) * x[0] ** 4)), rule_called("gauss-3")),
        "bad: its Lagrangian holds the unknown symbol gn0"),
    **{f"Lagrangian that is {name}": (
        lambda bad=bad: with_lagrangian(lambda x, v, p: v[0] ** 2 / 2 + bad * x[0]),
        r"line \d+: bad: its Lagrangian is not finite and real: write it without a division by 0")
       for name, bad in (("nan", sympy.nan), ("x/0", sympy.zoo), ("infinite", sympy.oo),
                         ("complex", sympy.I))},
    "a start without momentum": (
        lambda: with_lagrangian(lambda x, v, p: v[0] ** 2 / (2 * (p.a - 2)), parameters={"a": 2})
        .flow(1).trajectory(1),
        "bad: its Lagrangian is no finite real number at x0, v0; begin elsewhere, or give other"),
    "time where the parameters are": (
        lambda: with_lagrangian(lambda x, v, s: v[0] ** 2 / 2 - s * x[0]).flow(1),
        "the third argument is p, the parameters, one of them p.name; the time is a fourth, t"),
    "damping": (
        lambda: Scene("bad", pair(1), lambda x, v, p: v[0] ** 2, x0=[0], v0=[0], dissipation=1),
        r"there is no dissipation=; say force=lambda x, v, p: \[...\]"),
    "a strange function": (
        lambda: with_lagrangian(
            lambda x, v, p: v[0] ** 2 / 2 + sympy.gamma(x[0])).flow(1).trajectory(1),
        "the function gamma cannot be put into a kernel; there are sin, cos"),
    "an absolute value": (
        lambda: with_lagrangian(
            lambda x, v, p: v[0] ** 2 / 2 - sympy.sqrt(x[0] ** 2)).flow(1).trajectory(1),
        "holds Abs .*no derivative everywhere: write it without"),
    **{name: (lambda e=expression: with_lagrangian(
        lambda x, v, p: v[0] ** 2 / 2 - e.subs("z", x[0])).flow(1).trajectory(1),
        f"the {said} cannot be put into a kernel; there are sin, cos")
       for name, expression, said in (
           ("a jump", sympy.floor(Z), "derivative of floor"),
           ("an unknown function", sympy.Function("f")(Z), "derivative of f"),
           ("a remainder", Z**2 + sympy.O(Z**9), r"expression O\(.*\) \(Order\)"),
       )},
    **{f"a spring of pieces, {name}": (
        lambda e=depth: with_lagrangian(lambda x, v, p: v[0] ** 2 / 2 - e.subs("z", x[0]) ** 2),
        "line .*Lagrangian of .* holds Abs .or Max, Min, Piecewise.* its gradient has no")
       for name, depth in (
           ("Max", sympy.Max(0, -Z)), ("Min", sympy.Min(0, Z)), ("Abs", (abs(Z) - Z) / 2),
           ("root", (sympy.sqrt(Z**2) - Z) / 2),
           ("Piecewise", sympy.Piecewise((-Z, Z < 0), (0, True))),
       )},
    "no velocity": (lambda: with_lagrangian(lambda x, v, p: x[0] ** 2),
                    "bad with midpoint: .*does not depend on u, so FL is singular everywhere"),
    "discrete only": (
        lambda: Scheme(Scene("d", pair(1), discrete_lagrangian=lambda x, u, h, p: h * u[0] ** 2,
                             x0=[1], v0=[0]), midpoint).flow(1).trajectory(1),
        r"d has only a discrete Lagrangian.*trajectory\(..., mu0=...\)"),
    "Γ off the sphere": (lambda: top(x0=[1, 1, 1]),
                         r"heavy-top: \|Γ\|² is 3 at x0, but must be 1; change x0"),
    "Γ rounded": (lambda: top(x0=[0.6, 0.8, 0]), r"\|Γ\|² is .*an exact value: fractions"),
    # rules
    "rule's name": (lambda: rule_called("midpont"), 'no rule "midpont": did you mean midpoint?'),
    "rule unlike any": (lambda: rule_called("zzz"), "there are rectangle, midpoint, trapezoidal"),
    "rule as text": (lambda: Scheme(plain(), "midpoint"), r"'midpoint' is no rule: write .*get\("),
    "what G has not": (lambda: with_rule(lambda L, G, x, u, h: G.point(x)), "; G has target, vel"),
    **{f"rule that is {name}": (
        lambda bad=bad: with_rule(lambda L, G, x, u, h: h * L(x, u) * bad),
        "rule .* is not finite and real")
       for name, bad in (("nan", sympy.nan), ("x/0", sympy.zoo), ("complex", sympy.I))},
    "rule undecorated": (lambda: Scheme(plain(), lambda L, G, x, u, h: 0), "is no rule: decorate"),
    "rule without brackets": (lambda: discretisation(lambda L, G, x, u, h: 0), "with brackets"),
    "rule of four": (lambda: discretisation(name="mine")(lambda L, G, x, u: 0),
                     r"rule mine: the function takes 4 .* five: \(L, G, x, u, h\)"),
    "order a text": (lambda: discretisation(order="2"), "whole number from 1, not '2'"),
    "order 0": (lambda: discretisation(order=0), "whole number from 1, not 0"),
    "order 2.0": (lambda: discretisation(order=2.0), r"whole number from 1, not 2\.0"),
    "rule a vector": (lambda: with_rule(lambda L, G, x, u, h: u), r"mine is a matrix \(2, 1\)"),
    "rule raises": (lambda: with_rule(lambda L, G, x, u, h: 1 / 0), "rule mine could not be eval"),
    "rule asks": (lambda: with_rule(lambda L, G, x, u, h: L.weight), "mine asks for what is not"),
    "rule's element": (lambda: with_rule(lambda L, G, x, u, h: G.element(u, h)[0, 0]),
                       r"pair\(2\) has no group elements"),
    # scenes, groupoids
    "a lattice's name": (lambda: scenes.get("fput"), r'scenes\.lattices\.get\("fput"\)'),
    "scene's name": (lambda: scenes.get("pendulm"), 'no scene "pendulm": did you mean pendulum?'),
    "scene unlike any": (lambda: scenes.get("zzz"), "there are harmonic, pendulum,"),
    "Cayley on sl(3)": (
        lambda: Scheme(Scene("s", action(sl(3)), lambda x, v, p: v.dot(v), x0=[0] * 3,
                             v0=[0] * 8), midpoint),
        r"Cayley transform does not map sl\(3\) into its group .* use the exponential"),
    "action that is left": (
        lambda: check_axioms(action(so(3), right_action=lambda x, g: g * x, dim_x=3)),
        r"action\(so\(3\), lambda\) is not a groupoid: .*target of a product.*a right action has"),
    "action that moves at e": (
        lambda: check_axioms(action(so(3), right_action=lambda x, g: (g.T * x) * 2, dim_x=3)),
        r"is not a groupoid: b\(x, 0\) = x .* x·e = x"),
    "action of another length": (
        lambda: check_axioms(action(so(3), right_action=lambda x, g: g.T * x, dim_x=2)),
        r"its map could not be evaluated with symbols|its map returned"),
    "action without dim_x": (lambda: action(so(3), right_action=lambda x, g: g.T * x),
                             r"needs its map and the dimension of its base"),
    "action of rows and a map": (
        lambda: action(so(3), rows=2, right_action=lambda x, g: x, dim_x=3),
        "rows are for row vectors"),
    "product of a number": (lambda: product(pair(1), 3), r"a product of 3: give two groupoids"),
    "connection of two pairs": (
        lambda: product(pair(1), pair(1), connection=lambda x: [[1]]),
        r"a connection belongs to product\(pair\(n\), lie_group\(algebra\)\)"),
    "connection of another shape": (
        lambda: check_axioms(product(pair(1), lie_group(so(3)), connection=lambda x: [[1, 2]])),
        r"A\(x\) is \(1, 2\), but must be \(3, 1\)"),
    "connection no function": (
        lambda: product(pair(1), lie_group(so(3)), connection=[[1], [2], [3]]),
        "give a function of x"),
    "product's element": (lambda: product(pair(1), pair(1)).element(sympy.Matrix([1, 2]), 1),
                          r"pair\(1\) × pair\(1\) has no group elements"),
    "x off the sphere": (
        lambda: Scheme(scenes.get("spherical-pendulum").with_values(x0=[1, 0, 1]), midpoint),
        r"spherical-pendulum: \|x\|² is 2 at x0, but must be 1"),
    "momentum off its constraint": (
        lambda: Scheme(scenes.get("spherical-pendulum").with_values(v0=[1, 0, 0]), midpoint),
        r"spherical-pendulum: μ·x is 0\.66\d+ at x0, but must be 0"),
    "a run's momentum off its constraint": (
        lambda: Scheme(SCENES["spherical-pendulum"], midpoint).flow("1/20", 30)
        .trajectory(1, mu0=[1, 1, 1]),
        r"spherical-pendulum: μ·x is 0\.333333 at this start, but must be 0; change mu0"),
    "a run's x off the sphere": (
        lambda: Scheme(SCENES["spherical-pendulum"], midpoint).flow("1/20", 30)
        .trajectory(1, x0=[0, "1.001", 0], mu0=[1, 0, 0]),
        r"\|x\|² is 1\.002 at this start, but must be 1"),
    # flows and runs
    "step 0": (lambda: scheme("pendulum", "midpoint").flow(0), "a step of 0 goes nowhere"),
    "step nan": (lambda: scheme("pendulum", "midpoint").flow(NAN), "step is nan"),
    "step a text": (lambda: scheme("pendulum", "midpoint").flow("a"), 'step is "a", which is no'),
    "step None": (lambda: scheme("pendulum", "midpoint").flow(None), "give a step, or a tolerance"),
    **{f"digits {d!r}": (lambda d=d: pendulum().scheme.flow(1, d), "digits is .*give 16")
       for d in (15, 0, -50, 50.0, "50", True, None, [50])},
    **{f"steps {n!r}": (lambda n=n: pendulum().trajectory(n), "steps is .*whole number from 0")
       for n in (-1, 1.5, "3", None, True)},
    **{f"every {n!r}": (lambda n=n: pendulum().trajectory(3, n), "every is .*whole number from 1")
       for n in (0, -2, 1.5, "2", None)},
    "start x0": (lambda: pendulum().trajectory(1, x0=[1, 2]), "x0 has 2 entries, but 1"),
    "start mu0": (lambda: pendulum().trajectory(1, mu0=[1, 2]), "a vector has 2 entries, but 1"),
    "start mu0 nan": (lambda: pendulum().trajectory(1, mu0=[NAN]), "nan: give a finite number"),
    "first guess": (lambda: pendulum().trajectory(1, u0=[]), "a vector has 0 entries, but 1"),
    "evolve": (lambda: pendulum().evolve([1, 2], [1]), "pendulum: a vector has 2 entries"),
    "evolve nan": (lambda: pendulum().evolve([NAN], [1]), "nan: give a finite number"),
    "devolve": (lambda: pendulum().devolve([1], [1, 2]), "pendulum: a vector has 2 entries"),
    "pullback": (lambda: pendulum().pullback_defect([1], []), "a vector has 0 entries"),
    "Poisson": (lambda: pendulum().poisson_defect([], [1]), "a vector has 0 entries"),
    "tangent": (lambda: pendulum().tangent([1], ["a"]), 'is "a", which is no number'),
    # one entry of a wrong kind
    "Lagrangian None": (lambda: with_lagrangian(lambda x, v, p: None), "does it return what it"),
    "rule None": (lambda: with_rule(lambda L, G, x, u, h: None), "does it return what it"),
    "ragged parameter": (lambda: with_lagrangian(kinetic, parameters={"a": [[1, 2], [3]]}),
                         "bad: the rows of parameter a differ in length"),
    "field unknown": (lambda: plain().with_values(colour=1),
                      "no 'colour': its fields are name"),
    "steps_for 0": (lambda: plain().steps_for(0), "step is 0: give a positive number"),
    "scene's name a list": (lambda: scenes.get(["pendulum"]), "no scene .* did you mean pendulum"),
    "mu0 no list": (lambda: pendulum().trajectory(1, mu0=1.0), r"is 1\.0: give a list of 1 num"),
    "evolve no list": (lambda: pendulum().evolve(1, 2), "is 1: give a list of 1 numbers"),
    "scene as text": (lambda: Scheme("pendulum", midpoint), "'pendulum' is no scene: give a Sc"),
    "scene and rule swapped": (lambda: Scheme(midpoint, plain()), "midpoint is a rule, where a s"),
    "retraction of a scheme": (lambda: Scheme(scenes.get("rigid-body"), midpoint, retraction="x"),
                               r"no retraction=; say scene=SCENE.with_retraction"),
    "ordr": (lambda: discretisation(ordr=2), r"there is no ordr=; say order="),
    "x + h u/2 on a group": (
        lambda: Scheme(scenes.get("rigid-body"), discretisation(name="pairs")(
            lambda L, G, x, u, h: h * L(x + h * u / 2, u))), r"write G\.target\(x, u, h/2\)"),
    **{f"pieces in a lattice: {word}": (
        lambda word=word, f=f: Scheme(Lattice("bad", pair(1), 2, **{
            "on_site": kinetic, "on_bond": lambda x, y, p: 0, word: f, "v0": [[0], [0]],
            "x0": [[0], [1]]}), rule_called("trapezoidal")), rf"{word}= of bad holds Abs")
       for word, f in (("on_bond", lambda x, y, p: -sympy.Abs(y[0] - x[0])),
                       ("force", lambda x, v, p: [-sympy.Max(x[0], 0)]))},
    "a scheme of a problem": (
        lambda: Scheme(Control(plain(), lambda x, v, f, p: f[0] ** 2, ([1], [0])), midpoint),
        r"solve it by problem\.solve\(steps, rule\)"),
    "a retraction for equations": (lambda: Scheme(plain(), midpoint, "cayley"),
                                   r"'cayley' is no StepEquations"),
    "kind of a quantity": (lambda: Conserved("J", lambda x, mu, p: mu[0], kind="first intgral"),
                           "no kind='first intgral': did you mean 'first integral'"),
    "a list in a list of constraints": (
        lambda: Scheme(replace(scenes.get("cartesian-pendulum"),
                               holonomic=lambda x, p: [[x.dot(x) - 1]]), midpoint),
        r"must give a list of expressions φ.* say"),
    "size as text": (lambda: so("3"), r"so\('3'\): the size is a whole number from 2"),
    "dimension as text": (lambda: LocalGroupoid("1", 1, target=None, product=None),
                          "needs dim_x ≥ 0 and dim_u ≥ 1, not '1' and 1"),
    "dimension 1.5": (lambda: LocalGroupoid(1.5, 1, target=None, product=None), r"not 1\.5 and 1"),
    "rows 0": (lambda: action(so(3), rows=0), "rows is 0: give a whole number from 1"),
    "effective order below the order": (
        lambda: discretisation(order=4, effective=2), "the effective order 2 .* below its order 4",
    ),
    "reversible of odd order": (
        lambda: one_step(order=1, reversible=True), "undoes a step has an even order; say order=2",
    ),
    "effective order of no order": (lambda: discretisation(effective=4), "give order=2, or what"),
    "effective order 2.5": (
        lambda: one_step(order=2, effective=2.5), "effective order .* whole number from 1, not 2",
    ),
    "order True": (lambda: discretisation(order=True), "whole number from 1, not True"),
    "Γ off the sphere at the start of a run": (
        lambda: flow("heavy-top", "midpoint", "1/20").trajectory(1, x0=[1, 1, 1]),
        r"heavy-top: \|Γ\|² is 3 at this start, but must be 1"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_it_is_refused_in_a_sentence(case):
    attempt, message = CASES[case]
    with pytest.raises(BadInput, match=message) as caught:
        attempt()
    text = str(caught.value)
    assert "\n" not in text.strip()
    assert len(text) < 320
    assert isinstance(caught.value, DiscmechError) and isinstance(caught.value, ValueError)


@pytest.mark.parametrize("raised", [SystemExit(3), GeneratorExit(), KeyError("a")])
def test_whatever_a_rule_raises_is_told_with_its_line(raised):
    def rule(L, G, x, u, h):
        raise raised

    with pytest.raises(BadInput, match=f"could not be evaluated.*{type(raised).__name__}"):
        _ = with_rule(rule).FL


@pytest.mark.parametrize("make", [
    lambda: plain(duration=10**6000),
    lambda: plain(parameters={"a": "1e99999"}),
    lambda: with_rule(lambda L, G, x, u, h: h * L(x, u) * 10**6000).FL,
])  # fmt: skip
def test_numbers_that_nobody_can_print_are_refused(make):
    with pytest.raises(BadInput, match="choose units that fit the motion"):
        make()


def test_what_is_no_list_no_function_and_no_number_of_digits():
    for make, words in (
        (lambda: plain(x0=np.array(1.0)), "x0 is array"),
        (
            lambda: flow("duffing", "midpoint", "0.1").trajectory(1, x0=np.array(1.0), mu0=[1]),
            "list of 2",
        ),
        (
            lambda: Scheme(plain(), one_step(name="flat")(lambda s, z, h: np.array(1.0))),
            "2 (expressions|entries)",
        ),
        (lambda: with_rule(lambda L, G, x, u, h: {"2": "3"}).FL, "rule"),
        (lambda: one_step(name=sympy.Symbol("x") > 0)(lambda s, z, h: z), "x > 0 .* is no text"),
        (lambda: plain(symmetries=3), "symmetries is 3"),
        (lambda: plain(symmetries=np.array(1.0)), "symmetries is array"),
        (lambda: code(sympy.Symbol("x") * 10**4400), "number of about 4"),
        (lambda: code(sympy.Rational(1, 10**4400)), "number of about 4"),
        (lambda: discretisation(order=2)(3), "a rule is a function"),
        (lambda: Scheme(plain(), midpoint).flow("0.1", 10**9), "up to 10000"),
        (lambda: Scheme(plain(), midpoint).flow("0.1").trajectory(1, 2**60), r"up to 2\*\*53"),
    ):
        with pytest.raises(BadInput, match=words):
            make()


def test_names_of_ones_own_are_taken():
    """A name says that arguments are in another order only where it is that of another one."""
    for function, *wanted in (
        (lambda t: None, "(done)"), (lambda p: None, "(done)"), (lambda q, p, c: 0, "(x, mu, p)"),
        (lambda u, v, c: 0, "(x, y, p)"), (lambda q, qd, par, time: 0, "(x, v, p, t)"),
        (lambda x, p, scale=2: 0, "(x, p)", "(x, p, t)"), (lambda *p: 0, "(x, v, p)"),
    ):  # fmt: skip
        check_function(function, "it", *wanted)
    own = Scene("own", pair(1), hamiltonian=lambda q, p, c: p[0] ** 2 / c.m, mu0=[3], x0=[1],
                parameters={"m": 4})  # fmt: skip
    assert Scheme(own, midpoint).flow(1).trajectory(2).x[-1] == pytest.approx(4)


def nested(x, times):
    for _ in range(times):
        x = sympy.sin(x)
    return x


@pytest.mark.slow
def test_what_is_nested_deeply_works_and_more_deeply_ends_in_a_sentence():
    @discretisation(order=2)
    def deep(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), u) * nested(1 + x[0], 300)

    def horner(x):  # sixty products in sixty sums
        return reduce(lambda value, k: value * x / 2 + sympy.Rational(1, k), range(1, 61))

    for potential in (lambda x: nested(x, 60), horner):
        scheme = with_lagrangian(lambda x, v, p, of=potential: v[0] ** 2 / 2 + of(x[0]))
        assert len(scheme.flow("0.01").trajectory(3).x) == 4
    with pytest.raises(BadInput, match=r"line .*its Lagrangian has more than 100 .* sooner"):
        with_lagrangian(lambda x, v, p: v[0] ** 2 / 2 + nested(x[0], 200))
    with pytest.raises(BadInput, match=r"line .*rule deep has more than 100 .* sooner"):
        Scheme(scenes.get("pendulum"), deep)
    target = LocalGroupoid(1, 1, target=lambda x, u, h: [nested(x[0], 200) + h * u[0]],
                           product=lambda x, u, v, h: [u[0] + v[0]])  # fmt: skip
    with pytest.raises(BadInput, match=r"target has more than 100 .* sooner"):
        Scheme(plain(groupoid=target), midpoint)
