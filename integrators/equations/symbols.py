"""The letters that a scene's expressions are written in, and its Lagrangian written in them."""

from __future__ import annotations

import dis
import re
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from functools import cached_property
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any

import numpy as np

from ..errors import RAISED, BadInput, CannotMeasure, at_line, line_of, remedy, shown
from ..groupoids import Clocked
from ..numbers import (
    Arithmetic,
    floats_exact,
    refuse_large,
    short_numbers,
    sympy,
    to_sympy,
    without_text,
)
from ..numbers.types import (
    Column,
    Exact,
    Expression,
    Function,
    Given,
    GivenVector,
    Letter,
    Mpf,
    Number,
    Replacement,
    SymbolicMatrix,
)
from ..scene import Conserved, OnGroup, Scene, entries_of, takes_fourth
from .constant import Constant

#: names of coordinates, coefficients and intermediate results
_TAKEN = re.compile(
    r"h|(x|u|v|w|y|d|s|r|g|B|iB|c_of_g|mu|ex|emu|la|nu|ve)(_\d+)*|[a-z]{1,2}\d+(_\d+)*"
)


def vector(letter: str, length: int) -> Column:
    """Return real letters letter_0, letter_1, …, as a column."""
    return column(sympy.Symbol(f"{letter}_{i}", real=True) for i in range(length))


def column(entries: Iterable[Expression]) -> Column:
    """Return the entries as a column, n×1 also for none."""
    items = list(entries)
    return sympy.Matrix(len(items), 1, items)


def times(one: SymbolicMatrix, other: SymbolicMatrix) -> SymbolicMatrix:
    """Return one · other without multiplying by zero.

    Sympy's product checks for every entry that 0 times it is 0, so that each of its letters and
    functions is finite: for the gradient of many springs this takes longer than its derivation.
    """
    columns = other.T.tolist()
    return sympy.Matrix(one.rows, other.cols, [
        sympy.Add(*[a * e for a, e in zip(row, column, strict=True) if a != 0 and e != 0])
        for row in one.tolist() for column in columns
    ])  # fmt: skip


class SceneSymbols:
    """Columns x, u, v, y, mu (natural momenta), the step h and the parameters of one scene.

    It keeps the scene's groupoid and its functions, which are written in these letters, and no
    value: another scene that differs only in values has these symbols too. With a rule of k
    internal stages also s, a column of k·m letters (`stages`), and the rule's constants
    (`constant`).
    """

    def __init__(self, scene: Scene, stages: int = 0) -> None:
        self.name, self.groupoid = scene.name, scene.groupoid
        self.n, m = scene.groupoid.dim_x, scene.groupoid.dim_u
        #: True if the time is the last entry of x
        self.clocked = scene.clocked
        self.stages = vector("s", stages * m)
        if self.clocked:
            self.groupoid = Clocked(scene.groupoid, self.stages[::m])
        #: the discrete Lagrangian that the scene gives itself, or None
        self.given = scene.discrete_lagrangian
        self._lagrangian, self._fast, self._force = scene.lagrangian, scene.fast, scene.force
        self._hamiltonian = scene.hamiltonian
        self._one_form = scene.one_form
        #: True if x is a phase space with the form dϑ, and μ = ϑ(x)
        self.degenerate = scene.one_form is not None
        self.forced = scene.force is not None
        self.constraints = scene.all_constraints
        own = self.groupoid.symbols
        self.x, self.u, self.v, self.h = own["x"], own["u"], own["v"], own["h"]
        self.y = vector("y", self.groupoid.dim_x)
        self.mu = vector("mu", m)
        self.constants: dict[Letter, Constant] = {}
        self.parameters = SimpleNamespace()
        self.parameter_list: list[Letter] = []
        for name, value in scene.parameters.items():
            setattr(self.parameters, name, self._parameter(name, value))
        #: (B, B⁻¹) of the current translate, if L_d is given on the group
        self.translate: tuple[SymbolicMatrix, ...] = ()
        algebra = getattr(scene.groupoid, "algebra", None)
        if isinstance(self.given, OnGroup) and algebra is not None:
            self.translate = tuple(self.matrix(name, algebra.size) for name in ("B", "iB"))

    def for_another_rule(self) -> SceneSymbols:
        """Return these letters without the constants, which belong to one rule."""
        other = copy(self)
        other.constants = {}
        return other

    def with_time_as_parameter(self) -> SceneSymbols:
        """Return these letters with the time as the last parameter, not as the last entry of x.

        They are those of the continuous equations at one time.
        """
        if not self.clocked:
            return self
        self.lagrangian, self.force  # noqa: B018 - evaluated while x holds the time
        other, time = copy(self), self.x[-1]
        other.x, other.y, other.clocked = self.position, self.y[: self.n, :], False
        assert isinstance(self.groupoid, Clocked)
        other.groupoid = self.groupoid.inner
        other.parameter_list = [*self.parameter_list, time]
        return other

    @staticmethod
    def matrix(letter: str, size: int) -> SymbolicMatrix:
        """Return letters of a square matrix."""
        return sympy.Matrix(size, size, lambda i, j: sympy.Symbol(f"{letter}_{i}_{j}", real=True))

    def _parameter(self, name: str, value: Exact) -> Letter | SymbolicMatrix:
        if _TAKEN.fullmatch(name):
            name = f"p.{name}"  # no identifier, so no other symbol has it
        if not isinstance(value, tuple):
            rows, columns, ending = 1, 1, ""
        else:
            if len({len(row) if isinstance(row, tuple) else 0 for row in value}) > 1:
                raise BadInput(f"{self.name}: the rows of parameter {name} differ in length.")
            nested = isinstance(value[0], tuple) if value else False
            rows, columns = len(value), len(value[0]) if nested else 1
            ending = "_{}_{}" if nested else "_{}"

        def letter(i: int, j: int) -> Letter:
            return sympy.Symbol(name + ending.format(i, j), real=True)

        while set(matrix := sympy.Matrix(rows, columns, letter)) & set(self.parameter_list):
            name = f"p.{name}"  # such as the first of a, beside an a_0
        self.parameter_list.extend(matrix)
        return matrix if ending else matrix[0]

    @property
    def q(self) -> list[Letter]:
        """The arguments of a kernel's `prepare`: h, parameters, the rule's constants, B and B⁻¹."""
        translate = [e for matrix in self.translate for e in matrix]
        return [self.h, *self.parameter_list, *self.constants, *translate]

    @property
    def identity_translate(self) -> Replacement:
        """The values of the translate's letters for B = e."""
        return {
            b[i, j]: sympy.Integer(i == j)
            for b in self.translate for i in range(b.rows) for j in range(b.cols)
        }  # fmt: skip

    @property
    def stage_columns(self) -> list[Column]:
        """The stages one by one: k columns m×1, as a rule gets them."""
        m = len(self.u)
        return [self.stages[i : i + m, :] for i in range(0, len(self.stages), m)]

    def q_values(
        self, step: Exact, parameters: Sequence[Exact], numbers: Arithmetic
    ) -> list[Number]:
        """Return the values of `q` at B = e, as numbers of an arithmetic.

        parameters: their values in the order of `parameter_list` (`Scene.parameter_values`).
        """
        constants = [c(numbers.digits + 20) for c in self.constants.values()]
        e = [int(entry) for entry in self.identity_translate.values()]
        return [numbers.number(v) for v in (step, *parameters, *constants, *e)]

    def constant(self, value: Callable[[int], Mpf]) -> Letter:
        """Return a letter for a number that `value(digits)` computes to any number of digits."""
        one = Constant(value)
        for symbol, known in self.constants.items():
            if known == one:
                return symbol
        symbol = sympy.Symbol(f"gn{len(self.constants)}", real=True)
        self.constants[symbol] = one
        return symbol

    def constant_values(self, digits: int) -> Replacement:
        """Return the constants as sympy numbers of that many digits."""
        return {c: sympy.Float(value(digits), digits) for c, value in self.constants.items()}

    def exact_parameters(self, scene: Scene) -> Replacement:
        """Return the parameters' values in a scene, exactly."""
        return dict(zip(self.parameter_list, map(to_sympy, scene.parameter_values), strict=True))

    @property
    def position(self) -> Column:
        """x without the time, n×1."""
        return self.x[: self.n, :]

    def with_time(self, x: Given, t: Given = 0) -> Given:
        """Return a point of `position` with the time t behind it if x contains one."""
        if not self.clocked or not np.iterable(x):  # other values are refused elsewhere
            return x
        point = list(x)
        return [*point, t] if len(point) == self.n else point

    def call(self, function: Function, what: str, *arguments: Any) -> Expression:
        """Return the scalar that a user's function gives for symbols.

        what: its name in messages. Raises `BadInput`, one sentence with the line, for any error of
        the function and for a result that is no scalar.
        """
        return self.scalar(self.evaluated(function, what, *arguments), what, function)

    def evaluated(self, function: Function, what: str, *arguments: Any) -> Any:
        """Return the result of a user's function for symbols; raises as `call` does."""
        try:
            with short_numbers(f"{self.name}: {what}"):
                return summing_at_once(function)(*arguments)
        except BadInput as error:
            place = line_of(function, error)
            if not place or place in str(error):
                raise
            raise type(error)(f"{place}: {error}") from error
        except AttributeError as error:
            names = ", ".join(vars(self.parameters)) or "none"
            known = remedy(error) if "NDimArray" in str(error) else f"the parameters are: {names}"
            said = f"{self._at(function, what, error)} asks for what is not there ({error})"
            raise BadInput(f"{said}; {getattr(error.obj, 'offers', known)}.") from error
        except RAISED as error:
            raise BadInput(
                f"{self._at(function, what, error)} could not be evaluated with symbols "
                f"({type(error).__name__}: {error}); {remedy(error)}."
            ) from error

    def _at(self, function: Function | None, what: str, error: BaseException | None = None) -> str:
        return f"{at_line(function, error)}{self.name}: {what}"

    def scalar(self, value: Given, what: str, function: Function | None = None) -> Expression:
        """Return a sympy scalar of an expression or a 1×1 matrix, with floats made exact.

        Raises `BadInput` for anything else, naming the function that gave it.
        """
        place = self._at(function, what)
        value = without_text(value, place) if isinstance(value, str) else value
        if getattr(value, "shape", ()) != ():
            if tuple(value.shape) != (1, 1):
                raise BadInput(f"{place} is a matrix {value.shape}, not a number.")
            value = value[0, 0]
        try:
            if isinstance(value, dict | set | frozenset):
                raise TypeError  # sympy would read the words in it as code
            expression = sympy.sympify(value, strict=True)
            if not isinstance(expression, sympy.Expr):
                raise TypeError
        except (sympy.SympifyError, TypeError, ValueError, AttributeError):
            forgot = "; does it return what it computes?" if value is None else "."
            raise BadInput(
                f"{place} is {shown(value)}, not an expression in its arguments{forgot}"
            ) from None
        refuse_large(expression, place)
        return floats_exact(expression)

    def scalars(self, values: GivenVector, what: str, function: Function | None) -> Column:
        """Return a column of `scalar`s; raises `BadInput` also if one is not finite and real."""
        scalars = column(self.scalar(e, what, function) for e in values)
        if scalars.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo, sympy.I):
            raise BadInput(
                f"{self._at(function, what)} is not finite and real: write it without a division "
                "by 0, nan, oo and I."
            )
        return scalars

    @cached_property
    def lagrangian(self) -> Expression:
        """l(x, u); raises `CannotMeasure` if the scene has only a discrete one."""
        if self._lagrangian is not None:
            _, *rest = self._at_point(self._lagrangian, self.x, self.u)
            self.refuse_attitude(self._lagrangian, "its Lagrangian", *rest)
        return self.lagrangian_at(self.x, self.u)

    def refuse_unknown_of_lagrangian(self) -> None:
        """Raise `BadInput` if the scene's Lagrangian, where it gives one, has unknown letters."""
        if self._lagrangian is not None:
            entries, known = column([self.lagrangian]), {*self.x, *self.u}
            words = "x, v, p and t"
            self.refuse_unknown(entries, known, "its Lagrangian", self._lagrangian, words)

    @cached_property
    def hamiltonian(self) -> Expression | None:
        """H(x, μ) if the scene gives it; None if it gives a Lagrangian.

        Raises `BadInput` for unknown letters.
        """
        if self._hamiltonian is None:
            return None
        expression, what = self.hamiltonian_at(self.x, self.mu), "its Hamiltonian"
        words, known = "x, mu, p and t", {*self.x, *self.mu}
        if self.degenerate:
            words, known = "x and p", {*self.x}
        self.refuse_unknown(column([expression]), known, what, self._hamiltonian, words)
        return expression

    def hamiltonian_at(self, x: Column, mu: Column) -> Expression:
        """Return H at any columns x and μ, for a scene that gives it."""
        assert self._hamiltonian is not None
        arguments = self._at_point(self._hamiltonian, x, mu)
        if self.degenerate:  # a function of x alone
            arguments = (x, self.parameters)
        return self.call(self._hamiltonian, "its Hamiltonian", *arguments)

    @cached_property
    def one_form(self) -> Column:
        """ϑ(x), n×1, of a degenerate scene; raises `BadInput` as `force` does."""
        return self._components(self._one_form, "its one-form", "x and p", self.x, self.parameters)

    @property
    def phase_lagrangian(self) -> Expression:
        """l(x, u), or μ·u − H(x, μ) for a given H: its slope ρ̂ᵀ∂/∂x is the force's."""
        H = self.hamiltonian
        return self.lagrangian if H is None or self.degenerate else self.mu.dot(self.u) - H

    def fast_at(self, x: Column) -> Expression:
        """Return the fast part of the potential at a column x; `CannotMeasure` if there is none."""
        if self._fast is None:
            raise CannotMeasure(
                f"{self.name} names no fast part of its potential: give Scene(fast=...), or "
                "use another rule."
            )
        return self.call(self._fast, "its fast potential", x, self.parameters)

    def lagrangian_at(self, x: Column, v: Column) -> Expression:
        """Return l at any columns x and v; raises `CannotMeasure` if only L_d is given."""
        if self._lagrangian is None:
            raise CannotMeasure(
                f"{self.name} has only a discrete Lagrangian, so this cannot be asked."
            )
        arguments = self._at_point(self._lagrangian, x, v)
        return self.call(self._lagrangian, "its Lagrangian", *arguments)

    def _at_point(self, function: Function, x: Column, v: Column) -> tuple[Any, ...]:
        """Return the arguments of a function of (x, v, p) or (x, v, p, t)."""
        time = (x[self.n],) if takes_fourth(function) else ()
        return x[: self.n, :], v, self.parameters, *time

    def refuse_attitude(self, function: Function | None, what: str, *rest: Any) -> None:
        """Raise `BadInput` if a function of (x, *rest) depends on x where the base has no point.

        rest: the other arguments, with letters in the place of x.
        """
        if self.n or function is None:
            return
        algebra = getattr(self.groupoid, "algebra", None)
        size = 8 if algebra is None else algebra.real.size
        pose = vector("pose", size * size)
        for x in (pose, pose.reshape(size, size)):
            try:
                answer = summing_at_once(function)(x, *rest)
            except Exception:  # a call with the empty x reports any error
                continue
            if _letters_in(answer) & {*pose}:
                here = "this groupoid, which has no base; write it without x."
                if algebra is not None:
                    here = (
                        "a Lie group, whose state is the momentum; for what depends on the "
                        f"attitude A take scene.with_attitude(), where x[{size}*i + j] is A[i, j] "
                        "and A(0) = e."
                    )
                raise BadInput(f"{self._at(function, what)} asks for x, which is empty on {here}")

    @cached_property
    def force(self) -> Column:
        """f(x, u), m×1; empty without a force.

        Raises `BadInput` for another number of components, unknown letters and infinite ones.
        """
        if self._force is None:
            return column(())
        arguments = self._at_point(self._force, self.x, self.u)
        self.refuse_attitude(self._force, "its force", *arguments[1:])
        return self._components(self._force, "its force", "x, v, p and t", *arguments)

    def _components(self, function: Any, what: str, words: str, *arguments: Any) -> Column:
        """Return the m components that a user's function gives, as finite expressions."""
        answer = self.evaluated(function, what, *arguments)
        entries = self.scalars(entries_of(answer), what, function)
        if len(entries) != len(self.u):
            raise BadInput(
                f"{self._at(function, what)} has {len(entries)} components, but the velocity has "
                f"{len(self.u)}: give one for each."
            )
        self.refuse_unknown(entries, {*self.x, *self.u}, what, function, words)
        return entries

    def conserved(
        self, quantity: Conserved, x: SymbolicMatrix | None = None, h: Expression | None = None
    ) -> list[Expression]:
        """Return the entries of a quantity at (x, μ), x by default `position`, and a step h.

        Raises `BadInput` as `call` does, and for unknown letters.
        """
        x, h = self.position if x is None else x, self.h if h is None else h
        answer = self.evaluated(quantity.at, quantity.name, x, self.mu, self.parameters, h)
        entries = [self.scalar(e, quantity.name, quantity.formula) for e in entries_of(answer)]
        known, words = {*x, *self.mu, self.h}, "x, mu, p and h"
        self.refuse_unknown(column(entries), known, quantity.name, quantity.formula, words)
        return entries

    def refuse_unknown(
        self, entries: Column, known: set[Letter], what: str, function: Function | None, words: str
    ) -> None:
        """Raise `BadInput` for letters beside the known ones and parameters."""
        if foreign := entries.free_symbols - known - {*self.parameter_list}:
            raise BadInput(
                f"{self._at(function, what)} holds the unknown symbol {min(map(str, foreign))}; "
                f"write it with {words}."
            )

    def discrete_lagrangian_at(self, x: Column, arrow: Column, h: Expression) -> Expression:
        """Return L_d(x, u; h), or L_d(x, g; h) on the group, as the scene gives it."""
        if self.given is None:
            raise BadInput(
                "the rule own stands for the discrete Lagrangian that a scene gives itself."
            )
        function = self.given.formula if isinstance(self.given, OnGroup) else self.given
        return self.call(function, "its discrete Lagrangian", x, arrow, h, self.parameters)


def _letters_in(value: Any) -> set[Letter]:
    """Return the symbols in an expression, or in lists and arrays of them."""
    if getattr(value, "shape", None) == ():  # numpy's array of one number cannot be iterated
        value = value[()]
    if not isinstance(value, str) and hasattr(value, "__iter__"):
        return {letter for e in value for letter in _letters_in(e)}
    return set(getattr(value, "free_symbols", ()))


# -- Python's `sum` over expressions, with all terms added at once ---------------------------------


def at_once(terms: Iterable[Any], /, start: Any = 0) -> Any:
    """Return `sum`; of expressions it is one sum, with the same terms in one order.

    Python adds one after another, and sympy sorts all of the terms again each time: five hundred
    springs take 1.5 s instead of 0.02.
    """
    summands = list(terms)
    if (
        summands
        and isinstance(start, int)
        and start == 0
        and all(isinstance(e, sympy.Expr) for e in summands)
    ):
        return sympy.Add(*summands)
    return sum(summands, start)


def summing_at_once(function: Function) -> Function:
    """Return the function with `at_once` as its `sum`, or itself if `sum` is not Python's.

    Functions that it calls are not changed, nor is a function that writes names of its module: it
    would write them elsewhere.
    """
    if (
        not isinstance(function, FunctionType)
        or "sum" not in function.__code__.co_names
        or "sum" in function.__globals__
        or _writes_globals(function.__code__)
    ):
        return function
    names = {**function.__globals__, "sum": at_once}
    other = FunctionType(function.__code__, names, function.__name__, function.__defaults__,
                         function.__closure__)  # fmt: skip
    other.__kwdefaults__ = function.__kwdefaults__
    return other


def _writes_globals(code: CodeType) -> bool:
    return any(
        e.opname in ("STORE_GLOBAL", "DELETE_GLOBAL")
        or (isinstance(e.argval, CodeType) and _writes_globals(e.argval))
        for e in dis.get_instructions(code)
    )
