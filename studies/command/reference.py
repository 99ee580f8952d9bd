"""The subcommand `discmech reference`: certified digits of a scene, and checks of the tables."""

from __future__ import annotations

import argparse
import time
from typing import Any

from discmech.integrators import BadInput, scenes
from discmech.integrators.numbers import MOST_DIGITS

from ..core import lookup
from ..core.options import whole
from .output import progress_shown, write_json

PASS, FAIL, INCONCLUSIVE = 0, 1, 3


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "reference",
        help="certified digits of a scene; frozen tables",
        epilog="Exit codes: 0 all requested digits are certain, 1 --check finds a table "
        "wrong or damaged, 2 bad input, 3 fewer digits are certain.",
    )
    parser.add_argument(
        "scene", nargs="?", metavar="SCENE", help="the name of a scene (discmech list)"
    )
    parser.add_argument("--time", metavar="T", help='exact: "0.1" is 1/10 (default: the duration)')
    parser.add_argument(
        "--digits", metavar="D", default="50", help="certain digits, 1 to 10000 (default: 50)"
    )
    parser.add_argument("--attitude", action="store_true", help="with the group element A(t)")
    parser.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    others = parser.add_mutually_exclusive_group()
    others.add_argument(
        "--rebuild", nargs="+", metavar="SCENE", help="compute frozen tables again (all: every one)"
    )
    others.add_argument(
        "--check", nargs="+", metavar="SCENE", help="recompute frozen tables (all: every one)"
    )
    parser.set_defaults(action=_reference)


def _reference(options: argparse.Namespace) -> int:
    from discmech.reference import ReferenceFailure
    from discmech.reference.failures import Damaged, Uncertain, WrongDigits

    if bool(options.scene) == bool(options.rebuild or options.check):
        raise BadInput("name one SCENE, or ask for --rebuild or --check.")
    try:
        if options.rebuild or options.check:
            return _tables(options)
        return _one(options)
    except (WrongDigits, Uncertain) as failure:
        print(f"discmech: {failure}")
        return FAIL if isinstance(failure, WrongDigits) else INCONCLUSIVE
    except ReferenceFailure as failure:
        if options.check and isinstance(failure, Damaged):
            print(f"discmech: {failure}")
            return FAIL
        raise BadInput(str(failure)) from None


def _one(options: argparse.Namespace) -> int:
    """Answer for one scene at one time."""
    from discmech.reference import progress_to, solution

    digits = whole("--digits", MOST_DIGITS)(options.digits)
    begun = time.perf_counter()
    with progress_shown("loading") as show, progress_to(show):
        scene = lookup.scene(options.scene)
        when = scene.duration if options.time is None else options.time
        answer = solution(scene, when, digits, options.attitude)
    seconds = time.perf_counter() - begun
    result = _as_data(scene.name, answer, digits, seconds)
    if options.json:
        write_json(options.json, result, indent=1)
    if options.json != "-":
        _print(result)
    return PASS if answer.certain_digits >= digits else INCONCLUSIVE


def _as_data(name: str, answer: Any, digits: int, seconds: float) -> dict[str, Any]:
    import mpmath

    def numbers(values: Any) -> list[str]:
        shown = max(1, answer.certain_digits)
        return [
            mpmath.nstr(value, shown, strip_zeros=False, min_fixed=-3, max_fixed=9)
            for value in values
        ]

    turned = answer.attitude
    return {
        "schema": 1, "scene": name, "time": str(answer.t), "digits": digits,
        "certain_digits": answer.certain_digits, "certainty": answer.certainty,
        "bound": None if answer.bound is None else mpmath.nstr(answer.bound, 3),
        "method": answer.method, "evidence": answer.evidence,
        "x": numbers(answer.x), "v": numbers(answer.v), "mu": numbers(answer.mu),
        "attitude": None if turned is None else [numbers(row) for row in turned.tolist()],
        "seconds": round(seconds, 3),
    }  # fmt: skip


def _print(result: dict[str, Any]) -> None:
    print(f"{result['scene']} at t = {result['time']}: {result['certain_digits']} certain digits "
          f"by {result['certainty']}, {result['method']}")  # fmt: skip
    for name in ("x", "v", "mu"):
        for i, number in enumerate(result[name]):
            print(f"{name:>4}[{i}]  {number}")
    for i, row in enumerate(result["attitude"] or ()):
        for j, number in enumerate(row):
            print(f"A[{i},{j}]  {number}")
    print(result["evidence"])


def _tables(options: argparse.Namespace) -> int:
    """Rebuild or check frozen tables."""
    from discmech.reference import progress_to
    from discmech.reference.answer import frozen

    asked = options.rebuild or options.check
    names = frozen.names() if "all" in asked else [scenes.get(name).name for name in asked]
    for i, name in enumerate(names):
        with progress_shown() as show:

            def share(label: str, fraction: float, i: int = i) -> None:
                show(label, (i + fraction) / len(names))

            with progress_to(share):
                if options.rebuild:
                    table = frozen.build(name)
                    kinds = ", ".join(sorted({row.certainty for row in table.rows}))
                    words = f"{len(table.rows)} times, {frozen.DIGITS} digits by {kinds}"
                else:
                    words = f"at least {frozen.check(name)} digits agree with a fresh computation"
        print(f"{name:<20}{words}", flush=True)
    return PASS
