"""Generated text on numbers that carry a bound of their round-off."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .arithmetic import Arithmetic
from .numeric import run_text
from .registered import registered_names
from .running_error import RunningError, rounded, running
from .types import Number

#: derivative of a function at (argument, value), for the functions in generated text
_SLOPES: dict[str, Callable[[Any, Number, Number], Number]] = {
    "sin": lambda f, a, v: f["cos"](a),
    "cos": lambda f, a, v: f["sin"](a),
    "tan": lambda f, a, v: 1 + v * v,
    "asin": lambda f, a, v: 1 / f["sqrt"](1 - a * a),
    "acos": lambda f, a, v: 1 / f["sqrt"](1 - a * a),
    "atan": lambda f, a, v: 1 / (1 + a * a),
    "sinh": lambda f, a, v: f["cosh"](a),
    "cosh": lambda f, a, v: f["sinh"](a),
    "tanh": lambda f, a, v: 1 - v * v,
    "exp": lambda f, a, v: v,
    "log": lambda f, a, v: 1 / a,
    "sqrt": lambda f, a, v: 1 / (2 * v),
}


def with_running_errors(text: str, numbers: Arithmetic) -> Callable[..., Any]:
    """Return the function of a text that `numeric_text` wrote, on `RunningError`s of an arithmetic.

    Functions before it (series, functions of matrices) count as one operation each, whose
    derivatives are difference quotients: only the size of an error is needed.
    """
    plain = numbers.namespace()
    with numbers.working():
        names = dict(run_text(text, plain))  # a copy: those functions keep plain numbers
        names |= {name: _tracked(plain, name) for name in _SLOPES}
        names |= {"atan2": _atan2(plain), "abs": abs, "R": lambda e: RunningError(plain["R"](e))}
        names["PI"] = RunningError(plain["PI"], plain["PI"])
        names["constant"] = lambda name: rounded(plain["constant"](name))[()]
        names |= {name: _as_one(names[name], numbers)
                  for name in registered_names() if name in names}  # fmt: skip
        names["array"] = lambda entries, *shape: np.array(entries, dtype=object).reshape(shape)
        # only the function: the text before it was run on plain numbers
        return run_text(text[text.rindex("def function(") :], names)["function"]


def _tracked(plain: dict[str, Any], name: str) -> Callable[[Any], RunningError]:
    def function(argument: Any) -> RunningError:
        argument = running(argument)
        value = plain[name](argument.value)
        error = 0
        if argument.error:
            slope = _SLOPES[name](plain, argument.value, value)
            error = abs(slope) * argument.error
        return RunningError(value, error + abs(value))

    return function


def _atan2(plain: dict[str, Any]) -> Callable[[Any, Any], RunningError]:
    def function(y: Any, x: Any) -> RunningError:
        y, x = running(y), running(x)
        value, square = plain["atan2"](y.value, x.value), x.value**2 + y.value**2
        error = abs(x.value) * y.error + abs(y.value) * x.error
        return RunningError(value, (error / square if error else 0) + abs(value))

    return function


def _as_one(function: Callable[..., Any], numbers: Arithmetic) -> Callable[..., Any]:
    """Return a function of numbers as one operation on numbers with errors."""
    nearby = numbers.eps**0.5

    def whole(*arguments: Any) -> Any:
        flat = [running(e) for e in arguments]
        values = [e.value for e in flat]
        found = np.array(function(*values), dtype=object)
        errors = abs(found)
        for k, argument in enumerate(flat):
            if argument.error:
                moved = list(values)
                moved[k] = moved[k] + nearby
                change = np.array(function(*moved), dtype=object) - found
                errors = errors + abs(change) / nearby * argument.error
        result = rounded(found, errors)
        return result if found.shape else result[()]

    return whole
