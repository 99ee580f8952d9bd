"""Python with JAX: a step is a pure function of a state, which jits, vmaps and differentiates.

Newton's method is not differentiated: at its solution one more correction is, whose derivative is
that of the implicit function.
"""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Sequence
from math import factorial
from typing import Any, ClassVar

from ...errors import CannotMeasure
from ...numbers import Double, over
from .exported import EPS, Exported, head
from .numpy_file import Python, harness, python_parts
from .specialised import last_of

#: of a series of Stumpff's functions, at |z| up to 1
TERMS = next(n for n in range(99) if 4 * factorial(2) < EPS * factorial(2 * n + 4))
#: what each kernel does, for the reader of a file
ABOUT = {
    "solver": "Write a correction of the unknowns of a step, or the solution; return its size.",
    "update": "Write what x and mu grow by, less what the rounding of earlier sums added.",
    "carry": "Write the functions of x that the step after needs again.",
    "prepare": "Write what depends on the step and the parameters alone.",
    "extents": "Write sizes that tell how near a step is to the edge of its chart.",
    "branch": "Return a number that tells branches of solutions apart.",
    "energy_at": "Return the energy at x, v and mu.",
    "momenta_at": "Write the quantities that the scene declares.",
    "rates_at": "Write the rates of x and mu.", "speed_at": "Write the velocity of a momentum.",
}  # fmt: skip


def parsed(text: str) -> list[ast.FunctionDef]:
    """Return the functions of a text."""
    return [e for e in ast.parse(text).body if isinstance(e, ast.FunctionDef)]


def number_of(node: ast.expr) -> ast.expr:
    """Return the double of π, of a whole number or of a constant by its name; others unchanged."""
    if isinstance(node, ast.Name) and node.id == "PI":
        return ast.Constant(math.pi)
    if isinstance(node, ast.Call) and ast.unparse(node.func) in ("R", "constant"):
        value = ast.literal_eval(node.args[0])
        named = ast.unparse(node.func) == "constant"
        return ast.Constant(float(Double().constant(value) if named else value))
    return node


class _Arrays(ast.NodeTransformer):
    """Writes a kernel for arrays: numbers of the arithmetic, and linear equations at once."""

    def __init__(self) -> None:
        self.systems: dict[str, dict[tuple[int, int], ast.expr]] = {}
        self.sizes: dict[str, int] = {}

    def visit_Assign(self, node: ast.Assign) -> Any:
        """Collect the entries of linear equations."""
        (target,), value = node.targets, node.value
        if isinstance(value, ast.Call) and ast.unparse(value.func) == "zeros":
            self.systems[name := ast.unparse(target)] = {}
            self.sizes[name] = ast.literal_eval(value.args[0])
            return None
        if isinstance(target, ast.Subscript) and isinstance(target.value, ast.Subscript):
            at = ast.literal_eval(target.value.slice), ast.literal_eval(target.slice)
            self.systems[ast.unparse(target.value.value)][at] = self.visit(value)
            return None
        return ast.Assign(node.targets, self.visit(value))

    def visit_Expr(self, node: ast.Expr) -> Any:
        """Solve linear equations."""
        name = ast.unparse(node.value.args[0])  # type: ignore[attr-defined]
        entries, m = self.systems[name], self.sizes[name]
        rows = [[entries.get((i, j), ast.Constant(0.0)) for j in range(m + 1)] for i in range(m)]
        matrix = ast.List([ast.List(list(row)) for row in rows])
        return ast.Assign([ast.Name(name)], ast.Call(ast.Name("solved"), [matrix], []))

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        """Take an unknown of linear equations."""
        inner = node.value
        if isinstance(inner, ast.Subscript) and ast.unparse(inner.value) in self.systems:
            return ast.Subscript(inner.value, inner.slice)
        return node

    def visit_Call(self, node: ast.Call) -> Any:
        """Write numbers as numbers, and Stumpff's functions as one."""
        self.generic_visit(node)
        last = last_of(ast.unparse(node.func))
        if last is not None:
            return ast.Call(ast.Name("stumpff"), [ast.Constant(last), *node.args], [])
        return number_of(node)

    def visit_Name(self, node: ast.Name) -> Any:
        """Write π as a number."""
        return number_of(node)


class Jax(Python):
    """Prints Python whose truth values are arrays."""

    names: ClassVar[dict[str, str]] = {"abs": "jnp.abs"}
    words: ClassVar[dict[type, str]] = {**Python.words, ast.And: "&", ast.Or: "|"}
    joined: ClassVar[int] = 9

    def _written(self, e: ast.expr) -> tuple[str, int]:
        if isinstance(e, ast.Tuple):
            inner = ", ".join(map(self.of, e.elts))
            return f"({inner},)" if len(e.elts) == 1 else f"({inner})", 9
        if isinstance(e, ast.List):
            return f"[{', '.join(map(self.of, e.elts))}]", 9
        return super()._written(e)


FILE = '''"""{head}

In JAX a step is pure: it takes a state and returns another, full of NaN where it was not solved.
step and run jit, vmap and differentiate; run(state, h, steps, every) wants whole numbers of steps.
"""

{partial}from typing import NamedTuple

import jax
from jax import lax, numpy as jnp
from jax.numpy import cos, cosh, exp, log, sin, sinh, sqrt, tan, tanh
from jax.numpy import arccos as acos, arcsin as asin, arctan as atan, arctan2 as atan2

jax.config.update("jax_enable_x64", True)

{constants}
X0 = {x}
MU0 = {mu}
#: name -> value
PARAMETERS = {{
{parameters}
}}
#: names of the entries of momenta(state)
QUANTITIES = {quantities}


class State(NamedTuple):
    """x and mu with what their rounded sums lost, solutions of the last step, parameters."""

    x: jax.Array
    mu: jax.Array
    ex: jax.Array
    emu: jax.Array
    w: jax.Array
    q: jax.Array


def begin(x=X0, mu=MU0, **parameters):
    """Return a state at x and mu; parameters: those that differ from PARAMETERS."""
    if unknown := parameters.keys() - PARAMETERS.keys():
        raise TypeError(f"there is no parameter {{min(unknown)}}, but {{', '.join(PARAMETERS)}}")
    values = [jnp.ravel(jnp.asarray(parameters.get(name, value), dtype=float))
              for name, value in PARAMETERS.items()]
    q = jnp.concatenate([jnp.zeros(1), *values, jnp.array(OF_RULE, dtype=float)])
    x, mu = jnp.asarray(x, dtype=float), jnp.asarray(mu, dtype=float)
    if (x.shape, mu.shape) != ((N,), (M,)):
        raise ValueError(f"x has {{N}} entries and mu {{M}}, not {{x.shape}} and {{mu.shape}}")
    w = jnp.tile(guess(x, mu, q), (SUBSTEPS, 1))
    return State(x, mu, 0 * x, 0 * mu, lax.stop_gradient(w), q)


def step(state, h):
    """Return the state after a step of size h."""
    x, mu, ex, emu, ws, q = state
    solutions = []
    for j in range(SUBSTEPS):
        x, mu, ex, emu, w = substep(x, mu, ex, emu, ws[j], q.at[0].set(h * SHARES[j]), KINDS[j])
        solutions.append(w)
    return State(x, mu, ex, emu, lax.stop_gradient(jnp.stack(solutions)), q)


def run(state, h, steps, every=1):
    """Return the last state, and arrays x (rows, N), mu (rows, M) from the start on."""
    def row(state, _):
        state, _ = lax.scan(lambda s, _: (step(s, h), None), state, None, length=every)
        return state, (state.x, state.mu)

    end, (xs, mus) = lax.scan(row, state, None, length=steps // every)
    return end, (jnp.concatenate([state.x[None], xs]), jnp.concatenate([state.mu[None], mus]))


def substep(x, mu, ex, emu, w, q, kind):
    """Solve for w and add the increments of x and mu by compensated sums."""
    solver, update, carry, prepare, extents, affine = KERNELS[kind]
    c, xs, mus = prepare(q), tuple(x), tuple(mu)
    k = carry(xs, c)
    if PLACES:
        w = w.at[jnp.array(PLACES)].set(x[: len(PLACES)] / q[0])
    if affine:
        w = packed(solver(xs, mus, k, c))
    else:
        w = solved_by_newton(lambda w: solver(xs, tuple(w), mus, k, c), w)
    dx, dmu, _ = update(xs, tuple(w), mus, k, tuple(ex), tuple(emu), c)
    good = jnp.all(jnp.isfinite(w))
    if extents is not None:
        sizes, rests = extents(xs, tuple(w), c)
        good = good & jnp.all(jnp.abs(packed(sizes)) <= REACH) & jnp.all(packed(rests) > 0)
    x, ex = accumulated(x, dx, good)
    mu, emu = accumulated(mu, dmu, good)
    return x, mu, ex, emu, w


def accumulated(total, change, good):
    """Return the sum and by how much its rounding makes it too large; NaN unless it is good."""
    change = packed(change)
    new = jnp.where(good, total + change, jnp.nan)
    return new, lax.stop_gradient((new - total) - change)


def solved_by_newton(correct, w):
    """Return the w at which correct(w) -> (dw, size) is round-off, from a start; else NaN."""
    def body(carry):
        w, before, kappa, count, scale, _, _ = carry
        dw, size = correct(w)
        w = w + packed(dw)
        here = jnp.sum(jnp.abs(w))
        noise = EPS * jnp.maximum(here, scale)
        kappa = steepness(size, before, noise, kappa, count + 1)
        following = jnp.where(count > 0, MARGIN * kappa * size * size, LARGE)
        small = (count > 1) & (size < ROOT_EPS * noise / EPS)
        done = over(size, before, noise, following, small)
        return w, size, kappa, count + 1, here, done, size < LARGE

    def going(carry):
        *_, count, _, done, finite = carry
        return ~done & finite & (count < 40)

    w = lax.stop_gradient(w)
    start = (w, LARGE, LARGE, 0, jnp.sum(jnp.abs(w)), False, True)
    fixed = jax.tree.map(lax.stop_gradient, lax.while_loop(going, body, start))
    w = jnp.where(fixed[5] & fixed[6], fixed[0], jnp.nan)
    return w + packed(correct(w)[0])


def steepness(size, before, noise, kappa, count):
    """Return kappa after corrections: one of size s is followed by one of at most kappa s**2."""
    seen = jnp.where(before > 0, size / (before * before), kappa)
    larger = jnp.where((seen > kappa) | (count == 2), seen, kappa)
    bound = 64 * noise / (before * before)
    noisy = jnp.where(bound < kappa, bound, kappa)
    return jnp.where(count > 1, jnp.where(size > 64 * noise, larger, noisy), kappa)
{more}

def packed(values):
    """Return numbers as one array."""
    return jnp.stack([jnp.asarray(e, dtype=float) for e in values]) if values else jnp.zeros(0)


def solved(rows):
    """Return the unknowns of linear equations; each row ends with its right side."""
    table = jnp.stack([packed(row) for row in rows])
    return jnp.linalg.solve(table[:, :-1], table[:, -1])


{functions}


#: of the rule, and of its adjoint if substeps are its
KERNELS = [
{kernels}
]
'''
RUN = """_, (xs, mus) = jax.jit(run, static_argnums=(2, 3))(
            state, asked["h"], asked["steps"], asked["every"]
        )
        if not jnp.isfinite(mus).all():
            raise ValueError("a step was not solved")"""
MULTIPLIERS = '''

def multipliers(state, h):
    """Return the multipliers of the constraints at the start of the last step, of size h."""
    return 2 / (h * SHARES[0]) * state.w[0, {m} : {m} + {count}]
'''
STUMPFF = '''

@partial(jax.custom_jvp, nondiff_argnums=(0,))
def stumpff(last, z):
    """Return c[k], the sum of (-z)**n/(2*n + k)! over n, up to the last k: c[0] is cos(sqrt(z))."""
    def scaled(c):
        return lax.while_loop(lambda e: jnp.abs(e) > 1, lambda e: e / 4, c)

    def doubled(carry):
        small, c = carry
        more = [(c[0] * c[j] + c[1] * c[j - 1]
                 + sum(c[i] * OVER[j - i] for i in range(2, j + 1))) / 2**j
                for j in range(3, last + 1)]
        small = 4 * small
        root = sqrt(jnp.abs(small))
        first = jnp.where(small > 0, cos(root), cosh(root))
        second = jnp.where(small > 0, sin(root), sinh(root)) / root
        return small, [first, second, c[1] * c[1] / 2, *more]

    small = scaled(jnp.asarray(z, dtype=float))
    c = [0 * small] * (last + 1)
    for k in (last, last - 1):
        c[k] = OVER[2 * TERMS + k] + 0 * small
        for n in range(TERMS - 1, -1, -1):
            c[k] = OVER[2 * n + k] - small * c[k]
    for k in range(last - 2, -1, -1):
        c[k] = OVER[k] - small * c[k + 2]
    return lax.while_loop(lambda e: jnp.abs(e[0]) < jnp.abs(z), doubled, (small, c))[1]


@stumpff.defjvp
def _(last, primals, tangents):
    c = stumpff(last + 2, *primals)
    return c[: last + 1], [(k * c[k + 2] - c[k + 1]) / 2 * tangents[0] for k in range(last + 1)]
'''
GUESS = '''

def guess(x, mu, q):
    """Return where Newton's method starts at a new state."""
{lines}
    return packed([{entries}])
'''
SPEED = '''

def speed(x, mu, q):
    """Return the velocity with mu = dl/dxi."""
    {value}
'''
ENERGY = '''

def energy(state):
    """Return the energy of a state."""
    x, mu, q = state.x, state.mu, state.q
    return energy_at(x, {v}, mu, q)[0]
'''
MOMENTA = '''

def momenta(state):
    """Return the quantities that the scene declares, as QUANTITIES names them."""
    return packed(momenta_at(state.x, state.mu, state.mu, state.q))
'''


def jax_file(model: Exported, said: Sequence[str], with_harness: bool) -> str:
    """Return the JAX file of a scheme."""
    of_speed = "" if model.speed is None else model.speed.text
    text = "\n\n".join([model.text.partition("\nLAYOUT = ")[0], of_speed, *model.formulas.values()])
    sources = [f for f in parsed(text) if last_of(f.name.removesuffix("_near").removesuffix(
        "_far")) is None]  # fmt: skip
    if any(f.name.startswith("matrix_") for f in sources):
        raise CannotMeasure(
            "a step has functions of matrices, which a file in JAX cannot have, so it cannot be "
            "exported: in c, numpy or julia, or with --retraction cayley, it can."
        )
    functions = []
    for f in sources:
        f.decorator_list = []
        made, said_of = _Arrays().visit(f), ABOUT.get(f.name.partition("_of_")[0])
        made.body[:0] = [] if said_of is None else [ast.Expr(ast.Constant(said_of))]
        functions.append(Jax().function(ast.fix_missing_locations(made)))
    names = {f.name for f in sources}
    functions += [Jax().function(f) for f in parsed(inspect.getsource(over))]
    kernels = []
    for suffix, affine in zip(("", "_of_adjoint"), model.affine, strict=False):
        own = [f"{e}{suffix}" for e in ("solver", "update", "carry", "prepare")]
        extents = f"extents{suffix}" if f"extents{suffix}" in names else "None"
        kernels.append(f"    ({', '.join(own)}, {extents}, {affine}),")
    lines = ["    v = speed(x, mu, q)"] * model.needs_speed
    lines += ["    rates = packed(rates_at(x, v, mu, q))"] * ("rates_at" in names)
    entries = ["0.0" if "/" in e else e.replace("s.", "") for e in model.guess]
    more = GUESS.format(lines="\n".join(lines), entries=", ".join(entries))
    more = more.replace('"""\n\n', '"""\n')
    if model.needs_speed:
        more += SPEED.format(value=_speed(model))
    if model.has_energy:
        more += ENERGY.format(v="mu" if model.speed is None else "speed(x, mu, q)")
    more += MOMENTA * bool(model.quantities)
    if model.constants["MULTIPLIERS"]:
        more += MULTIPLIERS.format(m=model.constants["M"], count=model.constants["MULTIPLIERS"])
    turning = "stumpff_" in text
    more += STUMPFF * turning
    numbers = {e: model.constants[e] for e in (
        "N", "M", "KINDS", "SHARES", "SUBSTEPS", "REACH", "EPS", "ROOT_EPS", "LARGE", "MARGIN",
    )} | {"OF_RULE": model.of_rule, "V0": model.v0}  # fmt: skip
    if turning:  # two more for each derivative
        numbers |= {"TERMS": TERMS, "OVER": [1 / factorial(n) for n in range(60)]}
    numbers["PLACES"] = [i for i, e in enumerate(model.guess) if "/" in e]
    text = FILE.format(
        partial="from functools import partial\n" * turning, more=more,
        head="\n".join(head(model, "Python with JAX", said)),
        constants="\n".join(f"{k} = {v!r}" for k, v in numbers.items()),
        functions="\n\n\n".join(functions), kernels="\n".join(kernels), **python_parts(model),
    )  # fmt: skip
    return text + (harness(model, RUN) if with_harness else "")


def _speed(model: Exported) -> str:
    """Return the statement that gives the velocity of a state."""
    if model.speed is None:
        return "return packed(speed_at(x, mu, mu, q))"
    solver = "solver_of_speed(tuple(x), {}tuple(mu), (), prepare_of_speed(q))"
    if model.speed.affine:
        return f"return packed({solver.format('')})"
    return f"return solved_by_newton(lambda v: {solver.format('tuple(v), ')}, jnp.array(V0))"
