"""Numbers, verdicts and cases in words, for tables, figures and the page."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from ..core.records import number
from ..core.result import NONE, AnyResult

# with a larger energy error, relative to the energy's terms, a run shows another motion
RESOLVED = 0.1
#: the momentum before and after a step with constraints
CONSTRAINED = (
    "μ + h/2 A(x)ᵀλ = F⁻(x, u)/h",
    "F⁺(x, u)/h = μ′ − h/2 A(y)ᵀν, with A(y) ξ(y, μ′) = a(y)",
)

_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_FLAT = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_TENS = re.compile("(×|\\b)10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_NUMBER = re.compile(r"(?<![\w.])-?[0-9]+(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?")


def in_tens(value: float, places: int = 0) -> str:
    """Return a number such as 3.1×10⁻¹⁶; without the mantissa if it is exactly one."""
    mantissa, exponent = f"{value:.{places}e}".split("e")
    tens = "10" + superscript(int(exponent))
    if value > 0 and abs(value / 10.0 ** int(exponent) - 1) < 1e-9:
        return tens
    return f"{mantissa}×{tens}".replace("-", "−")


def subscript(index: Any) -> str:
    """Return a subscript, such as ₁₂ for 12."""
    return str(index).translate(_SUBSCRIPTS)


def superscript(power: Any) -> str:
    """Return a superscript, such as ⁻¹² for −12."""
    return str(power).translate(_SUPERSCRIPTS)


def raised(power: int) -> str:
    """Return a power of the step, h³."""
    return f"h{superscript(power)}"


def scientific(value: Any, places: int = 1) -> str:
    """Return 3.1×10⁻¹⁶, or plain digits if they are as short, or a dash if it is no number."""
    figure = number(value)
    if figure is None:
        return NONE
    if figure == 0:
        return "0"
    if 0.01 <= abs(figure) < 1000:
        return f"{figure:.{places + 2}g}".replace("-", "−")
    return in_tens(figure, places)


def numbers_in(words: str) -> list[float]:
    """Return the numbers in a text that `scientific` or Python wrote."""
    plain = _TENS.sub(lambda m: f"{'' if m[1] else 1}e{m[2].translate(_FLAT)}", words)
    return [float(text) for text in _NUMBER.findall(plain.replace("−", "-"))]


def duration(seconds: float) -> str:
    """Return a time such as 12 µs, 3.4 ms, 1.2 s."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size or unit == "µs":
            return f"{seconds / size:.3g} {unit}"
    raise AssertionError


def plus_minus(value: Any, interval: Any) -> str:
    """Return 2.000 ± 0.003, with three to six decimals as the interval allows; never ± 0.

    Numbers smaller than 0.001 get a common power of ten, (−0.1 ± 2.3)×10⁻⁹, and so do those of
    1000 and above, of which three decimals would say too much.
    """
    figure = number(value)
    if figure is None:
        return NONE
    low, high = _ends(interval)
    if low is None or high is None:
        return _fixed(figure, 3)
    half = max(high - figure, figure - low, 0.0)
    if (abs(figure) < 1e-3 and half < 1e-3) or max(abs(figure), half) >= 1e3:
        return _scaled(figure, half)
    decimals = 6 if half == 0 else min(6, max(3, -math.floor(math.log10(half))))
    unit = 10.0**-decimals
    half = max(math.ceil(half / unit - 1e-9), 1) * unit
    return f"{_fixed(figure, decimals)} ± {half:.{decimals}f}"


def _scaled(value: float, half: float) -> str:
    """Return a number with the half width of its interval, both times one power of ten."""
    if half == 0:
        return scientific(value)
    exponent = math.floor(math.log10(max(abs(value), half)))
    a, b = value / 10.0**exponent, half / 10.0**exponent
    decimals = min(4, max(1, -math.floor(math.log10(b)))) if b < 1 else 1
    b = max(math.ceil(b * 10**decimals - 1e-9), 1) / 10**decimals
    return f"({_fixed(a, decimals)} ± {b:.{decimals}f})×10{superscript(exponent)}"


def order_of(value: float, decimals: int = 4) -> str:
    """Return an order; one that is 0 to three decimals is 0.000 in every table, figure and text."""
    rounded = _fixed(value, 3)
    return rounded if rounded == "0.000" else _fixed(value, decimals)


def _fixed(value: float, decimals: int) -> str:
    """Return a number with so many decimals; what rounds to zero has no sign."""
    shown = f"{value:.{decimals}f}".replace("-", "−")
    return shown if shown.strip("−0.") else shown.strip("−")


def _ends(interval: Any) -> tuple[float | None, float | None]:
    if isinstance(interval, Sequence) and not isinstance(interval, str) and len(interval) == 2:
        return number(interval[0]), number(interval[1])
    return None, None


def why(case: AnyResult) -> str:
    """Return the reason of a case that does not pass, and the smallest case that fails as well."""
    small = case.smallest
    if small is None:
        return case.reason
    ones = f", also with {' and '.join(small.whatever)} set to 1" if small.whatever else ""
    steps = f"{small.scene} in {small.steps} steps" if small.steps else f"{small.scene}"
    again = "the same" if small.command == case.command != "" else small.command or steps
    return f"{case.reason} The smallest that fails: {again}{ones}."


def whys(cases: Sequence[AnyResult]) -> list[str]:
    """Return `why` for each case; a cause or reason given before is only referred to.

    Figures are those of one case alone. A case of another study is named with it.
    """
    reasons, told = list[str](), dict[str, AnyResult]()
    for case in cases:
        words = why(case)
        figure, mark, cause = words.partition(" Cause: ")
        key = cause if mark else words
        if words and key in told:
            first = told[key]
            name = first.name + ("" if first.study == case.study else f", in {first.study}")
            words = f"{figure} Cause: as of {name}." if mark else f"As {name}."
        elif words:
            told[key] = case
        reasons.append(words)
    return reasons


def limit(case: AnyResult) -> str:
    """Return the bound that a case has to meet, from above or from below; a program has none."""
    for key, sign in (("at_least", "≥"), ("limit", "≤")):
        if number(case.wanted.get(key)) is not None:
            return f"{sign} {scientific(case.wanted[key])}"
    if (part := number(case.wanted.get("resolved"))) is not None:  # of a program
        steps = f", along {case.wanted['steps']} steps" if case.wanted.get("steps") else ""
        return (
            f"no defect, seen to {scientific(part)} of what other methods of its order leave{steps}"
        )
    return pairs(case.wanted)


def largest(values: Mapping[str, Any]) -> str:
    """Return the largest of some numbers."""
    return scientific(max((v for v in map(number, values.values()) if v is not None), default=None))


def pairs(values: Mapping[str, Any]) -> str:
    """Return any dict in one line."""
    return ", ".join(f"{key} {_any(value)}" for key, value in values.items()) or NONE


def _any(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"({pairs(value)})"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(_any(entry) for entry in value) + "]"
    if value is None or isinstance(value, float):
        return scientific(value, 2)
    return str(value)
