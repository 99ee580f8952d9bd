"""Calls of a black box, step by step, with memory, or for a whole run; its answers are checked."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from ...errors import RAISED, BadInput, Displaced, StepFailure, at_line, line_of, remedy
from ...numbers.types import Matrix, Number, Vector
from .signatures import functions_of, takes_system

#: a `BlackBox`, and a `SceneInNumbers`, whose files come after this one
Box: TypeAlias = Any
System: TypeAlias = Any
#: sets the time before step k
Begin: TypeAlias = Callable[[int], None]
#: takes the number of a step, and the q and p after it
Keep: TypeAlias = Callable[[int, Vector, Vector], None]

DOUBLE = np.dtype(np.float64)
#: what a compiled function says of an array that cannot be written to, though it only reads it
NO_BUFFER = "buffer source array is read-only"


class BoxRaised(Exception):
    """The box raised an exception, or gives no rows of a run: the step's number, why, the fix.

    failure: the class of the error that a user sees.
    """

    failure: type[StepFailure] = StepFailure
    fix = "mend the black box, or take a smaller step"

    def __init__(self, index: int, said: str) -> None:
        self.index, self.said = index, said
        super().__init__(said)


class BeginsElsewhere(BoxRaised):
    """The first row of an answer is not the start."""

    failure = Displaced
    fix = "let the first row be the start as it came, with 17 digits (%.17g)"


class Calls:
    """A box on one scene at one step size: `run` makes steps in the box's own coordinates.

    kind: the type of its numbers.
    """

    def __init__(self, box: Box, system: System, h: Number, kind: type, scene: str) -> None:
        self.box, self.system, self.h, self.kind = box, system, h, np.dtype(kind)
        #: the function whose line messages name
        self._asked = box.formula.step if box.remembers else box.formula
        self.what = f"{at_line(self._asked)}{scene}: the black box {box.name}"
        #: the last argument of each function, where it takes one
        self._last = {name: (system,) if takes_system(*part) else ()
                      for name, part in functions_of(
                          box.formula, box.runs, box.step is not None).items()}  # fmt: skip
        self._by_copies = False  # True for a box that cannot read what must not be written to
        #: the arguments of a step after the state
        self._given = (*(() if box.step is not None else (h,)), *self._last.get("the function", ()))

    def run(
        self, q: Vector, p: Vector, steps: int, every: int, at: Begin, row: Keep, first: int = 0
    ) -> tuple[Vector, Vector]:
        """Make `steps` steps; call `row(k, q, p)` for the start and every `every`-th step.

        at(k) sets the time before step k. first: the number of the first step; only where each step
        is a call of its own may it be another than 0. Return the last state. Raises `BadInput` for
        answers of a wrong kind, `BoxRaised` for exceptions of the box, numbers that are not finite,
        and a first row that is not the start.
        """
        if not first:
            row(0, q, p)
        if not steps:
            return q, p
        made = [first]  # the number of the step that is being made; runs may be made side by side
        try:
            if self.by_steps:
                return self._stepwise(q, p, range(first, first + steps), every, at, row, made)
            (self._whole if self.box.runs else self._with_memory)(q, p, steps, every, at, row, made)
            return q, p
        except (BadInput, BoxRaised):
            raise
        except RAISED as error:
            raise self._raised(made[0], error) from error

    @property
    def by_steps(self) -> bool:
        """True if each step is a call of its own, of a function of the state."""
        return not (self.box.runs or self.box.remembers)

    def _stepwise(
        self, q: Vector, p: Vector, numbers: range, every: int, at: Begin, row: Keep,
        made: list[int],
    ) -> tuple[Vector, Vector]:  # fmt: skip
        function, last = self._unchanged, self._given
        shapes, kind = (q.shape, p.shape), self.kind
        plain, several = kind == DOUBLE and p.ndim == 1, p.ndim == 2
        q, p = q.copy(), p.copy()
        for k in numbers:
            made[0] = k
            at(k)
            answer = function(q, p, *last)
            if type(answer) is not tuple or len(answer) != 2:
                answer = self._pair(answer)
            q, p = answer
            if not (type(q) is type(p) is np.ndarray and q.dtype == p.dtype == kind
                    and (q.shape, p.shape) == shapes):  # fmt: skip
                q, p = self._arrays(q, p, shapes)
            q, p = q.copy(), p.copy()  # the answer may be a view, or a buffer of the box
            if several or (plain and not math.isfinite(np.vdot(q, q) + p.dot(p))):
                self._check_finite(k, q, p)
            if (k + 1) % every == 0:
                row(k + 1, q, p)
        return q, p

    def _unchanged(self, q: Vector, p: Vector, *last: Any) -> object:
        """Return the answer for arrays that the box must not change.

        They cannot be written to; but compiled functions refuse to read such ones (Cython's
        buffers, as in scipy's Rotation). A box with them gets copies, which are looked at after it.
        """
        if not self._by_copies:
            q.setflags(write=False)
            p.setflags(write=False)
            try:
                return self.box.formula(q, p, *last)
            except ValueError as error:
                if not str(error).startswith(NO_BUFFER):
                    raise
            self._by_copies = True
        own = q.copy(), p.copy()
        answer = self.box.formula(*own, *last)
        if not all(map(np.array_equal, own, (q, p))):
            raise BadInput(self._changes(at_line(self._asked)))
        return answer

    def _changes(self, begun: str) -> str:
        return (
            f"{begun}the black box {self.box.name} changes its argument in place; work on a copy: "
            "q = q + ..., not q += ...."
        )

    def _with_memory(
        self, q: Vector, p: Vector, steps: int, every: int, at: Begin, row: Keep, made: list[int]
    ) -> None:
        shapes, last = (q.shape, p.shape), self._last
        method = self.box.formula()
        at(0)
        state = method.start(q.copy(), p.copy(), self.h, *last["start"])
        for k in range(steps):
            made[0] = k
            at(k)
            state = method.step(state, self.h, *last["step"])
            if (k + 1) % every == 0 or k + 1 == steps:
                at(k + 1)
                q, p = self._arrays(*self._pair(method.read(state, *last["read"])), shapes)
                self._check_finite(k, q, p)
                if (k + 1) % every == 0:
                    row(k + 1, q.copy(), p.copy())

    def _whole(
        self, q: Vector, p: Vector, steps: int, every: int, at: Begin, row: Keep, made: list[int]
    ) -> None:
        at(0)
        last = self._last["the function"]
        answer = self.box.formula(q.copy(), p.copy(), self.h, steps, every, *last)
        rows = steps // every + 1
        qs, ps = self._arrays(*self._pair(answer), ((rows, *q.shape), (rows, *p.shape)))
        self._check_own(np.hstack([qs.reshape(rows, -1), ps]), np.hstack([q.ravel(), p]))
        if _displaced(qs[0], q) or _displaced(ps[0], p):
            off = max(abs(a - b).max(initial=0) for a, b in ((qs[0], q), (ps[0], p)))
            said = f"the answer begins elsewhere than at the start it was given, off by {off:.1e}"
            if all((a == b.astype(np.float32)).all() for a, b in ((qs[0], q), (ps[0], p))):
                said += ", as its rounding to single precision is: compute in double precision"
            turns = (qs[0] - q).astype(float) / (2 * np.pi)
            whole = np.abs(turns - np.round(turns)).max(initial=0) < 1e-9 < np.abs(turns).max()
            if whole and not _displaced(ps[0], p):
                said += ", whole turns of an angle that is kept within one turn"
            raise BeginsElsewhere(0, said)
        fine = self.kind.kind != "O" and bool(np.isfinite(qs).all() and np.isfinite(ps).all())
        for k in range(1, rows):
            if not fine:
                self._check_finite(k * every - 1, qs[k], ps[k])
            row(k * every, qs[k], ps[k])

    def _pair(self, answer: object) -> tuple[Vector, Vector]:
        if isinstance(answer, tuple | list) and len(answer) == 2:
            return answer[0], answer[1]
        shown = f"{len(answer)} things" if isinstance(answer, tuple | list) else _kind(answer)
        raise BadInput(f"{self.what} gives {shown}, but must give the pair (q, p).")

    def _arrays(
        self, q: object, p: object, shapes: tuple[tuple[int, ...], tuple[int, ...]]
    ) -> tuple[Vector, Vector]:
        """Return answers as arrays of the given shapes; raises `BadInput` for anything else."""
        arrays = []
        names = self.box.form.first, self.box.form.second
        for name, array, shape in zip(names, (q, p), shapes, strict=True):
            if not isinstance(array, np.ndarray):
                raise BadInput(
                    f"{self.what} gives {name} as {_kind(array)}, but must give an array of numpy "
                    f"of the shape {shape}: write np.array(...)."
                )
            if array.shape != shape:
                raise BadInput(
                    f"{self.what} gives {name} of the shape {array.shape}, but it must have the "
                    f"shape {shape}."
                )
            if array.dtype.kind == "c":
                raise BadInput(f"{self.what} gives {name} in complex numbers; give real ones.")
            if array.dtype.kind not in "fiu" + ("O" if self.kind.kind == "O" else ""):
                raise BadInput(f"{self.what} gives {name} of the type {array.dtype}; give numbers.")
            if self.kind.kind == "O" and array.dtype.kind != "O":
                raise BadInput(
                    f'{self.what} says numbers="any", but gives {name} as {array.dtype} where it '
                    "was given mpmath numbers: keep what is given, or leave numbers= out."
                )
            arrays.append(array.astype(self.kind))
        return arrays[0], arrays[1]

    def _check_own(self, rows: Matrix, start: Vector) -> None:
        """Raise `BadInput` for rows that are one array, which all show the last state."""
        rounded = 2.0**-20 * np.abs(start).max()  # a start in single precision is told elsewhere
        same = (rows[1:] == rows[-1]).all() and (np.abs(rows[-1] - start) > rounded).any()
        if same and (len(rows) > 2 or (len(rows) == 2 and (rows[0] == rows[1]).all())):
            raise BadInput(
                f"{self.what} gives rows that are all the same, as those of one array are that is "
                "changed in place: append q.copy() and p.copy()."
            )

    def _check_finite(self, k: int, q: Vector, p: Vector) -> None:
        if self.kind.kind == "O":
            import mpmath

            fine = all(mpmath.isfinite(e) for part in (q, p) for e in np.ravel(part))
        else:
            fine = bool(np.isfinite(q).all() and np.isfinite(p).all())
        if not fine:
            raise BoxRaised(k, "the black box gives numbers that are not finite")

    def _raised(self, k: int, error: BaseException) -> Exception:
        place = line_of(self._asked, error)
        begun = f"{place}: " if place else ""
        if isinstance(error, ValueError) and str(error).endswith(" is read-only"):
            return BadInput(self._changes(begun))
        where = f" ({place})" if place else ""
        if isinstance(error, ValueError) and self.system.n != self.system.m:
            where += (
                f"; here q has {self.system.n} and p {self.system.m} entries: say groupoids="
                '"pair" of a box that takes them to be as many'
            )
        said = " ".join(str(error).split())[:200]
        if k == 0 and isinstance(error, SLIPS):
            said += "; functions of the system take (q, p)" * said.startswith("SceneInNumbers.")
            said += f": {remedy(error)}" * isinstance(error, ImportError)
            said += "; q and p are arrays: take numpy's functions, np.sin in place of math.sin" * (
                "converted to Python scalars" in said
            )
            return BadInput(
                f"{begun}the black box {self.box.name} raises {type(error).__name__}: {said}."
            )
        return BoxRaised(k, f"the black box raises {type(error).__name__}: {said}{where}")


#: errors of a function's text, which it raises at its first step for any numbers: bad input, as all
#: is that a formula raises; any other error is one of the state and the step, and so a failed step
SLIPS = (TypeError, AttributeError, NameError, ImportError)
#: roundings of a start on its way into a program's own coordinates and back (such as p/m·m)
ROUNDINGS = 8


def _displaced(row: Vector, start: Vector) -> bool:
    """Return True if a run's first row differs from its start by more than roundings."""
    unit = 2.0**-23 if start.dtype == np.float32 else 2.0**-52
    return bool(abs(row - start).max(initial=0) > ROUNDINGS * unit * abs(start).max(initial=0))


def _kind(value: object) -> str:
    if value is None:
        return "nothing (does it return what it computes?)"
    word = type(value).__name__
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"
