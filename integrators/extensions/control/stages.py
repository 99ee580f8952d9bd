"""One step of a control problem: its Lagrange function, with cost and force at the rule's points.

The control is a polynomial in the time of a step, given by its values f at the r points where the
rule evaluates L: one at the middle for midpoint, two for gauss-2. The rows E of a step
(`StepEquations.step`) determine w = (u, stages) and the next state z = (x, μ), and

    ℒ(z, w, f, κ, p) = C_d(x, w, f) + κ·E(z, w, f) + p·Z(z, w, f)

gives all conditions of an optimum: stationary in w, f, κ, it generates the map of states and
costates, z′ = ∂ℒ/∂p′, p = ∂ℒ/∂z, which is symplectic for every rule.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ...equations import (
    DiscreteLagrangian,
    DiscretisedScene,
    SceneSymbols,
    force_points,
    momentum,
    vector,
)
from ...errors import BadInput, CannotMeasure, shown
from ...numbers import (
    Graph,
    Node,
    Scope,
    arithmetic,
    jacobian,
    numeric,
    opaque,
    sympy,
    within_doubles,
    without_text,
)
from ...numbers.types import Expression, Function, Letter, Matrix, Number, Vector
from ...rules import Discretisation
from ...scene import Column, Parameters, Point, Scalar, Scene, Velocity, arguments_of, remembered

MOST = 30  # largest number of corrections of a control at a node
HALVINGS = 12  # largest number of halvings of such a correction
# the last relative correction of velocities and controls, if the condition has a solution
NEAR = 1e-8
ROUND_OFF = 2.0**-50  # relative to the sum of the absolute values of a rule's weights

#: parameters of the controlled scene in addition to those of the scene
VALUES, PLACES, BEGIN, WIDTH = "control_values", "control_places", "step_begin", "step_width"


class ControlStages:
    """The Lagrange function of a step, (values, gradients, Hessians) in a = (x, μ, w, f, κ, p).

    n, m: the lengths of x and μ; places: the r fractions of a step at which the control has values;
    slices: the positions of x, mu, w, f, kappa, p in a.
    """

    def __init__(
        self,
        scene: Scene,
        cost: Function,
        inputs: Function | None,
        controls: int,
        rule: Discretisation,
    ) -> None:
        self.scene, self.rule, self.controls = scene, rule, controls
        self.numbers = arithmetic(16)
        self.places = places_of(scene, rule)
        controlled = _controlled(scene, inputs, controls, self.places)
        self._hamiltonian = self._checked(SceneSymbols(scene), cost, inputs or _itself)
        equations = DiscretisedScene(controlled, rule).equations
        self.s = s = equations.s
        step, graph = equations.step, equations.graph
        self.n, self.m = s.n, len(s.u)
        control = list(getattr(s.parameters, VALUES))
        w, kappa, p = step.w, vector("ka", len(step.w)), vector("pp", s.n + self.m)
        columns = {"x": s.position, "mu": s.mu, "w": w, "f": control, "kappa": kappa, "p": p}
        self.slices: dict[str, slice] = {}
        inputs_of_step: list[Letter] = []
        for name, letters in columns.items():
            self.slices[name] = slice(len(inputs_of_step), len(inputs_of_step) + len(letters))
            inputs_of_step += list(letters)
        rows = graph.minus(step.rows, step.wanted)
        start, grown = [*s.position, *s.mu], [*step.increment[: s.n], *step.gain]
        after, by = graph.plus(graph.letters(start), grown), graph.letters([*kappa, *p])
        of_step = graph.sum((1, a * e) for a, e in zip(by, [*rows, *after], strict=True))
        self._data = [s.x[-1], *(q for q in s.q if q not in control)]
        self._of_step = SecondDerivatives(of_step, inputs_of_step, self._data)
        self.cost_symbols = c = SceneSymbols(
            replace(controlled, lagrangian=_with_control(cost), force=None), rule.stages
        )
        of = DiscreteLagrangian(c, rule)
        of_cost = [c.x[-1], *(q for q in c.q if q not in control)]
        self._of_cost = SecondDerivatives(of.value, inputs_of_step, of_cost)
        #: whether a step's rows and its next state are affine in x, μ, w and f
        self.affine = not self._of_step.couples(self.slices["kappa"].start)
        #: everything from which it was made
        self.formulas = [step, of_step, of.value]

    def cost(self, a: np.ndarray, times: np.ndarray, h: float) -> tuple[np.ndarray, ...]:
        """Return C_d, its gradients and Hessians."""
        return self._of_cost(a, self._values(self.cost_symbols, times, h))

    def __call__(
        self, a: Matrix, times: Vector, h: float, share: float = 1.0
    ) -> tuple[np.ndarray, ...]:
        """Return (gradients (N, k), Hessians (N, k, k)) of ℒ at N rows a, begun at these times.

        share: the factor of the cost in ℒ.
        """
        of_step = self._of_step(a, self._values(self.s, times, h))
        if share == 0:
            return of_step[1:]
        of_cost = self.cost(a, times, h)
        return of_step[1] + share * of_cost[1], of_step[2] + share * of_cost[2]

    def gains(self, a: np.ndarray, times: np.ndarray, h: float) -> np.ndarray:
        """Return the controls' effect on a step's rows and on μ at N rows a: ∂(E, Z_μ)/∂f."""
        H, at = self._of_step(a, self._values(self.s, times, h))[2], self.slices
        rows = np.r_[at["kappa"], at["p"].start + self.n : at["p"].stop]
        return np.asarray(H[:, rows][:, :, at["f"]])

    def along(self, x: Matrix, u: Matrix, times: Vector) -> tuple[Matrix, np.ndarray]:
        """Return (∂l/∂ξ (N, m), the anchor ρ̂ (N, n, m)) at N points, velocities and times."""
        values = self._along(x.T, u.T, self._values(self.s, times, 1))
        mu, rho = (e.astype(float) for e in values)
        each = rho if rho.ndim == 3 else rho[:, :, None]  # constants are not repeated
        return mu.T, np.moveaxis(np.broadcast_to(each, (self.n, self.m, len(times))), -1, 0)

    @cached_property
    def _along(self) -> Function:
        s = self.s
        arguments = {"x": s.position, "u": s.u, "q": self._data}
        rho = (s.groupoid.rho(s.x, s.h) / s.h)[: self.n, :]
        return numeric(arguments, [list(momentum(s)), rho], self.numbers, columns=True)

    def at_nodes(
        self, x: np.ndarray, mu: np.ndarray, p: np.ndarray, times: np.ndarray, near: np.ndarray
    ) -> np.ndarray:
        """Return f with ∂/∂f (C + p_μ·inputs) = 0 at N states and costates p_μ, (N, k).

        This is Pontryagin's condition; f has the order of the states. Newton starts from `near`,
        (ξ, f), and halves each correction until the next one is smaller. If there is no such f, as
        at an end where a cost is nearly flat and the discrete costate just beyond its slope, the f
        of `near` is returned. Raises `LinAlgError` if the condition does not determine f to first
        order at any node.
        """
        m, data, y = self.m, self._values(self.s, times, 1), near.copy()

        def at(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            values = self._pontryagin(x.T, y.T, [*mu.T, *p.T], data).astype(float)
            slope = values[y.shape[1] :].reshape(y.shape[1], y.shape[1], -1)
            return values[: y.shape[1]].T[:, :, None], slope.transpose(2, 0, 1)

        def kinds(part: np.ndarray) -> tuple[np.ndarray, ...]:
            return tuple(abs(e).max(axis=1, initial=0) for e in np.split(part, [m], axis=1))

        def size(change: np.ndarray) -> np.ndarray:
            return np.max([a / b for a, b in zip(kinds(change), most, strict=True)], axis=0)

        rows, slope = at(y)
        for _ in range(MOST):
            back = _inverses(slope)
            if not np.isfinite(back).all(axis=(1, 2)).any():
                raise np.linalg.LinAlgError
            change, share = (back @ rows)[:, :, 0], np.ones((len(y), 1))
            most = [np.max([a.max(), b.max()]) or 1.0
                    for a, b in zip(kinds(y), kinds(change), strict=True)]  # fmt: skip
            before = size(change)
            for _ in range(HALVINGS):
                tried = y - share * change
                rows, slope = at(tried)
                left = size((back @ rows)[:, :, 0])
                worse = ~(left <= (1 - share[:, 0] / 4) * before) & ~(before <= NEAR)
                if not worse.any():
                    break
                share[worse] /= 2
            y = tried
            if not before.max() > 1e-14:
                break
        missed = ~(before <= NEAR)
        return np.where(missed[:, None], near, y)[:, m:]

    def _checked(
        self, s: SceneSymbols, cost: Function, inputs: Function
    ) -> tuple[Column, Column, Expression]:
        """Return f, p_μ and C + p_μ·inputs in letters; raises `BadInput` for unfit formulas."""
        f, p = vector("cf", self.controls), vector("pm", len(s.u))
        t = sympy.Symbol(BEGIN, real=True)

        def point(function: Function) -> tuple[Any, ...]:
            return s.position, s.u, f, s.parameters, *([t] * (arguments_of(function) == 5))

        of_cost = s.call(cost, "its cost", *point(cost))
        answer = s.evaluated(inputs, "its inputs", *point(inputs))
        shape = getattr(answer, "shape", None)
        many = hasattr(answer, "__iter__") if shape is None else shape != ()
        entries = list(answer) if many else []
        if len(entries) != len(s.u):
            raise BadInput(
                f"{s.name}: inputs= gives {shown(answer)}, but must give a list of {len(s.u)} "
                "components of force, one for each of the velocity."
            )
        force = [s.scalar(e, "its inputs", inputs) for e in entries]
        known = {*s.position, *s.u, *f, *s.parameter_list, t}
        for what, function, given in (("its cost", cost, [of_cost]), ("its inputs", inputs, force)):
            s.refuse_unknown(sympy.Matrix(given), known, what, function, "x, v, f, p and t")
        work = [left * right for left, right in zip(p, force, strict=True)]
        return f, p, of_cost + sympy.Add(*work)

    @cached_property
    def _pontryagin(self) -> Function:
        s, (f, p, hamiltonian) = self.s, self._hamiltonian
        rows = [*(momentum(s) - s.mu), *jacobian([hamiltonian], f)]
        slope = jacobian(rows, [*s.u, *f])
        arguments = {"x": s.position, "y": [*s.u, *f], "z": [*s.mu, *p], "q": self._data}
        return numeric(arguments, [[*rows, *slope]], self.numbers, columns=True)

    def _values(self, s: SceneSymbols, times: np.ndarray, h: float) -> list[Number]:
        """Return the data of a step; its clock is at 0, so the control's places are exact."""
        still = [0] * len(self.places) * self.controls
        own = [*self.scene.parameter_values, *still, *self.places, 0, h]
        values = dict(zip(s.q, s.q_values(h, own, self.numbers), strict=True))
        values[getattr(s.parameters, BEGIN)] = times
        control = set(getattr(s.parameters, VALUES))
        return [0.0, *(v for q, v in values.items() if q not in control)]


def _inverses(slopes: np.ndarray) -> np.ndarray:
    """Return the inverses of N matrices; that of a singular one is NaN."""
    try:
        return np.linalg.inv(slopes)
    except np.linalg.LinAlgError:
        return np.array([np.full_like(e, np.nan) if np.linalg.matrix_rank(e) < len(e)
                         else np.linalg.inv(e) for e in slopes])  # fmt: skip


def _itself(x: Point, v: Velocity, f: Column, p: Parameters) -> Column:
    return f


#: the `ControlStages` of a scene, cost, inputs, number of controls and rule, derived once
stages_of = remembered(maxsize=64)(ControlStages)


def places_of(scene: Scene, rule: Discretisation) -> list[float]:
    """Return the fractions of a step at which a rule evaluates L, in order.

    Raises `CannotMeasure` unless its weights sum to 1, because cost and force use them too, and if
    the fractions are no numbers.
    """

    def still(x: Point, v: Velocity, p: Parameters, t: Scalar) -> Scalar:
        return v.dot(v) / 2 + t

    s = SceneSymbols(Scene("still", scene.groupoid, still, x0=scene.x0, v0=scene.v0), rule.stages)
    of = DiscreteLagrangian(s, rule)
    if not of.asked:
        raise CannotMeasure(
            f"{scene.name}: cost and force take the weights of {rule.name}, which is no weighted "
            f"sum of values of L: {of.unweighted}"
        )
    times = [acting.point[-1] for acting in force_points(of)]
    at = {c: sympy.Float(v(30), 30) for c, v in s.constants.items()} | {s.x[-1]: 0, s.h: 1}
    weights = [sympy.sympify(weight).xreplace(at) for weight, _ in of.asked]
    total = sympy.Add(*weights)
    # control runs in double precision: float weights sum to 1 up to round-off
    if total.is_number and abs(total - 1) > ROUND_OFF * sum(map(abs, weights)):
        raise CannotMeasure(
            f"{scene.name}: the weights of {rule.name} sum to {float(total):.16g}: cost and "
            "force take them too, so that it solves another problem; let them sum to 1."
        )
    fractions = [sympy.sympify(sympy.sympify(e).xreplace(at)) for e in times]
    if any(e.free_symbols for e in fractions):
        raise CannotMeasure(
            f"{scene.name}: {rule.name} evaluates L at fractions of a step that depend on the "
            "motion, where controls have no place; take a rule with fractions that are numbers."
        )
    return sorted(set(map(float, fractions)))


def _controlled(scene: Scene, inputs: Function | None, controls: int, places: list[float]) -> Scene:
    """Return the scene under a control, with a clock that starts with the step.

    The values of the control are parameters, and so are the time at which the step begins and its
    width.
    """
    lagrangian: Any = scene.lagrangian
    force = scene.force
    control = _with_control(inputs or _itself)

    def acting(x: Point, v: Velocity, p: Parameters, t: Scalar) -> list[Scalar]:
        parts = [control(x, v, p, t)]
        if force is not None:
            parts.append(force(x, v, p, *_time(force, 4, p, t)))
        exact = without_text(parts, f"a force on {scene.name}")
        return [sum(entries) for entries in zip(*exact, strict=True)]

    values = {VALUES: [[0] * controls] * len(places), PLACES: places, BEGIN: 0, WIDTH: 1}
    return replace(
        scene,
        lagrangian=lambda x, v, p, t: lagrangian(x, v, p, *_time(lagrangian, 4, p, t)),
        force=acting,
        symmetries=(),
        parameters={**scene.parameters, **values},
    )


def _time(function: Function, wanted: int, p: Parameters, t: Scalar) -> tuple[Scalar, ...]:
    """Return the time as a tuple for a function that takes it, else (): step's start plus clock."""
    return (getattr(p, BEGIN) + t,) if arguments_of(function) == wanted else ()


def _with_control(function: Function) -> Function:
    """Return a function of (x, v, f, p) or (x, v, f, p, t) as one of (x, v, p, t)."""

    def at(x: Point, v: Velocity, p: Parameters, t: Scalar) -> Any:
        values, places = getattr(p, VALUES), getattr(p, PLACES)
        theta, f = t / getattr(p, WIDTH), 0 * values[0, :].T
        for j, c in enumerate(places):
            others = [e for e in places if e is not c]
            f += sympy.Mul(*[(theta - e) / (c - e) for e in others]) * values[j, :].T
        return function(x, v, f, p, *_time(function, 5, p, t))

    return at


# Value, gradient and Hessian of a scalar as one function of columns of numbers.
#
# Both derivatives are those of the scalar's graph, in which held nodes are computed once.


#: number of array entries that are computed at a time
CHUNK = 2**21


class SecondDerivatives:
    """A scalar of `inputs` and `data` (letters) as a function of columns of numbers.

    Raises `BadInput` for functions that double precision does not have.
    """

    def __init__(self, scalar: Node, inputs: Sequence[Letter], data: Sequence[Letter]) -> None:
        graph = Graph()  # in the scalar's own nothing is differentiated by parameters
        (value,) = graph.rebuilt([scalar], {})
        scope, by = Scope(graph), graph.letters(inputs)
        slopes = [graph.hold(e) for e in scope.jacobian([value], by)[0]]
        hessian = scope.jacobian(slopes, by)
        self.size = len(by)
        self._places = [(i, j) for i in range(self.size) for j in range(i + 1) if hessian[i][j]]
        results = [value, *slopes, *(hessian[i][j] for i, j in self._places)]
        self._function = _in_columns(graph, inputs, data, results)

    def couples(self, count: int) -> bool:
        """Return True if some second derivative by two of the first inputs is not 0."""
        return any(i < count and j < count for i, j in self._places)

    def __call__(self, a: np.ndarray, q: Sequence[Number | Vector]) -> tuple[np.ndarray, ...]:
        """Return (values (N,), gradients (N, k), Hessians (N, k, k)) at N rows of k inputs.

        q: the data, each a number or N numbers.
        """
        rows = max(1, CHUNK // self.size**2)
        with within_doubles("the control problem"):
            parts = [
                self._at(a[i : i + rows], [e[i : i + rows] if np.ndim(e) else e for e in q])
                for i in range(0, len(a), rows)
            ]
        return tuple(map(np.concatenate, zip(*parts, strict=True)))

    def _at(self, a: np.ndarray, q: list[Number | Vector]) -> tuple[np.ndarray, ...]:
        rows, k = len(a), self.size
        values = self._function(a.T, q)
        # also for constants; integers beyond 2⁶³ are Python's own
        values = np.broadcast_to(values.reshape(len(values), -1).astype(float), (len(values), rows))
        hessian = np.zeros((rows, k, k))
        for (i, j), entry in zip(self._places, values[1 + k :], strict=True):
            hessian[:, i, j] = hessian[:, j, i] = entry
        return values[0], values[1 : 1 + k].T, hessian


def _in_columns(
    graph: Graph, inputs: Sequence[Letter], data: Sequence[Letter], results: list[Node]
) -> Callable[..., np.ndarray]:
    """Return the results (r, N) as a function of columns; row by row if they branch (tables)."""
    branching = opaque(graph.order(results))
    arguments = {"a": inputs, "q": data}
    f = numeric(arguments, [results], arithmetic(16), columns=not branching, graph=graph)
    if not branching:
        return f

    def by_rows(*columns: Sequence[Vector]) -> np.ndarray:
        sizes = [len(part) for part in columns]
        entries = np.broadcast_arrays(*(e for part in columns for e in part))
        cuts = np.cumsum(sizes)[:-1]
        return np.array([f(*np.split(row, cuts)) for row in np.array(entries).T]).T

    return by_rows
