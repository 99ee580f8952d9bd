"""The equations of motion on the dual algebroid for peers: as expressions and as machine code."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from ctypes import CFUNCTYPE, c_int64, c_void_p
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.compiler import Array, address, compiled
from discmech.integrators.equations import closed_velocity, field_parts, momentum, vector_field
from discmech.integrators.numbers import Double, function_text, run_text, sympy, with_tables

#: ξ(x, μ) where it has no short closed form: Newton, halved until the rest shrinks; 1 if found
_VELOCITY = """
NAN = R("nan")


@aside
def velocity(z, xi, trial, matrix, left, step):
    turn, found = 0, 0
    while turn < 100 and found == 0:
        momenta, entries = momentum(z, xi), mass(z, xi)
        {left}
        {matrix}
        before = {before}
        matrix_quotient(step, matrix, left)
        if {moved} <= 2.0**-30 * ({size}):
            found = 1
            {step}
        else:
            share, halved = R(1), 0
            while halved < 50:
                {trial}
                rest = momentum(z, trial)
                if {rest} < before:
                    break
                share, halved = share / 2, halved + 1
            {taken}
        turn = turn + 1
    return found
"""


class Equations:
    """ż = f(z) with z = (x, μ): parameters are constants, so that a compiler may fold them.

    `field` is the sympy column f of `states`; `f(t, z)` → (n+m,) and `df(t, z)` → (n+m)×(n+m) are
    machine code. Where ξ(x, μ) has no short closed form there is no `field` (`CannotMeasure`), and
    they solve for ξ.

    timed: True if a peer is timed with them; else the same text runs as Python.
    """

    def __init__(self, scheme: Scheme, timed: bool = True) -> None:
        s, self.timed = scheme.s, timed
        self.name = scheme.scene.name.replace("-", "_").replace(".", "_")
        self.states = [*s.x, *s.mu]
        values = [float(v) for v in scheme.scene.parameter_values]
        letters = sympy.symbols(f"P:{len(values)}", real=True)
        self._named = dict(zip(s.parameter_list, letters, strict=True))
        self._s, self._start = s, [float(v) for v in scheme.scene.v0]
        self.constants = dict(zip(letters, values, strict=True))

    @cached_property
    def _field(self) -> Any:
        return vector_field(self._s).xreplace(self._named)

    @cached_property
    def field(self) -> Any:
        """f(z), (n+m)×1, its constants rounded to double precision."""
        field = self._field.xreplace({p: sympy.Float(v, 17) for p, v in self.constants.items()})
        return field.xreplace(
            {r: sympy.Float(r, 17) for r in field.atoms(sympy.Rational) if r.q > 2}
        )

    def _function(self, words: str, lines: Sequence[str], length: int) -> Callable[..., Any]:
        """(t, z) ↦ the `length` numbers that a text's `advance(z, out)` writes, as an array."""
        text = with_tables("\n".join([
            *(f"{p} = {v!r}" for p, v in self.constants.items()), *lines, "    return 0, 0"
        ]))  # fmt: skip
        names = run_text(text, Double().namespace())
        if not self.timed:
            return _in_numbers(names["advance"], length)
        arrays = dict.fromkeys(("z", "out"), Array("f"))
        code = compiled(f"{words}_{self.name}", text, names, arrays)
        return _in_machine_code(code, len(self.states), length)

    def _part(self, name: str, arguments: dict[str, Any], entries: Sequence[Any]) -> str:
        """The text of a function that gives the entries as a tuple."""
        named = [e.xreplace(self._named) for e in entries]
        return f"@kernel\n{function_text(name, arguments, [named])}"

    def _by_newton(
        self, results: Sequence[str], more: Sequence[str], out: Sequence[str]
    ) -> list[str]:
        """A text in which ξ is solved for; results: the parts of it that `out` is made of."""
        s, n, m = self._s, len(self._s.x), len(self._s.mu)
        arguments = {"z": self.states, "xi": s.u}
        parts = dict(zip(("rates", "by_z", "by_xi", "moving", "mass"), field_parts(s), strict=True))
        parts |= {"momentum": momentum(s)}

        def each(line: str) -> list[str]:
            return [line.format(k=k, at=n + k) for k in range(m)]

        def together(term: str) -> str:
            return " + ".join(f"abs({e})" for e in each(term))

        velocity = _VELOCITY.format(
            left="; ".join(each("left[{k}, 0] = z[{at}] - momenta[{k}]")),
            matrix="; ".join(f"matrix[{i}, {j}] = entries[{i * m + j}]"
                             for i in range(m) for j in range(m)),
            before=together("z[{at}] - momenta[{k}]"), moved=together("step[{k}, 0]"),
            size=together("xi[{k}] + step[{k}, 0]"), rest=together("z[{at}] - rest[{k}]"),
            step="; ".join(each("xi[{k}] = xi[{k}] + step[{k}, 0]")),
            trial="; ".join(each("trial[{k}] = xi[{k}] + share * step[{k}, 0]")),
            taken="; ".join(each("xi[{k}] = trial[{k}]")),
        )  # fmt: skip
        wanted = ("momentum", "mass", *results)
        return [
            *(self._part(name, arguments, list(parts[name])) for name in wanted), velocity,
            "def advance(z, out):",
            f"    xi, trial = zeros(1, {m})[0], zeros(1, {m})[0]",
            f"    matrix, left, step = zeros({m}, {m}), zeros({m}, 1), zeros({m}, 1)",
            *(f"    xi[{k}] = {v!r}" for k, v in enumerate(self._start)),
            "    found = velocity(z, xi, trial, matrix, left, step)",
            *(f"    {name}_ = {name}(z, xi)" for name in ("mass", *results)),
            *(f"    {line}" for line in more),
            *(f"    out[{i}] = {e}" for i, e in enumerate(out)),
            "    if found == 0:",
            *(f"        out[{i}] = NAN" for i in range(len(out))),
        ]  # fmt: skip

    def _closed(self, entries: Sequence[Any]) -> list[str]:
        """A text where ξ has a closed form; zeros are not written."""
        filled = [i for i, e in enumerate(entries) if e != 0]
        return [
            self._part("field", {"z": self.states}, [entries[i] for i in filled]),
            "def advance(z, out):", "    values = field(z)",
            *(f"    out[{i}] = values[{k}]" for k, i in enumerate(filled)),
        ]  # fmt: skip

    @cached_property
    def f(self) -> Callable[[float, Any], Any]:
        """f(t, z)."""
        size = len(self.states)
        if closed_velocity(self._s) is not None:
            return self._function("field", self._closed(list(self._field)), size)
        out = [f"rates_[{i}]" for i in range(size)]
        return self._function("field", self._by_newton(["rates"], [], out), size)

    @cached_property
    def df(self) -> Callable[[float, Any], Any]:
        """∂f/∂z at (t, z)."""
        size, m = len(self.states), len(self._s.mu)
        if closed_velocity(self._s) is not None:
            derivative = self._function(
                "slope", self._closed(list(self._field.jacobian(self.states))), size**2
            )
        else:
            more = [f"right, slopes = zeros({m}, {size}), zeros({m}, {size})"]
            more += [f"matrix[{i}, {j}] = mass_[{i * m + j}]" for i in range(m) for j in range(m)]
            more += [f"right[{i}, {j}] = moving_[{i * size + j}]"
                     for i in range(m) for j in range(size)]  # fmt: skip
            more += ["matrix_quotient(slopes, matrix, right)"]
            out = [
                " + ".join([f"by_z_[{i * size + j}]",
                            *(f"by_xi_[{i * m + k}] * slopes[{k}, {j}]" for k in range(m))])
                for i in range(size) for j in range(size)
            ]  # fmt: skip
            derivative = self._function(
                "slope", self._by_newton(["by_z", "by_xi", "moving"], more, out), size**2
            )
        return lambda t, z: derivative(t, z).reshape(size, size)


def _in_numbers(advance: Callable[..., Any], length: int) -> Callable[[float, Any], Any]:
    """A text's function run by Python: NaN where Python raises, as machine code has NaN or inf."""

    def asked(t: float, z: Any) -> Any:
        out = np.zeros(length)
        try:
            with np.errstate(all="ignore"):
                advance(z, out)
        except (ArithmeticError, ValueError):
            out[:] = np.nan
        return out

    return asked


def _in_machine_code(advance: Any, states: int, length: int) -> Callable[[float, Any], Any]:
    """The compiled function with arrays of its own: peers are timed with it, in one thread."""
    state, out = np.zeros(states), np.zeros(length)
    place, counters = advance.engine.get_function_address("advance"), (c_int64 * 2)()
    function = CFUNCTYPE(None, c_void_p, c_void_p, c_void_p)(place)
    call = partial(function, address(state), address(out), counters)

    def asked(t: float, z: Any) -> Any:
        state[:] = z
        call()
        return out.copy()

    asked.code = advance  # type: ignore[attr-defined]  # which owns the machine code
    return asked


#: the equations of motion of a scheme's scene, derived once
equations_of = lru_cache(maxsize=64)(Equations)
