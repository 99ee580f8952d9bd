"""What a study is asked on the command line: scenes, rules, precisions, and what is its own."""

from __future__ import annotations

import argparse
import math
import shlex
from typing import TYPE_CHECKING, Any

from discmech.integrators import BadInput, retractions

from . import lookup

if TYPE_CHECKING:
    from .case import Choice

THOROUGH = ("work-precision", "stability", "charts", "savings")  # studies that can take longer
MOST_PERIODS = 10**12  # of a race
RULE_HELP = "midpoint, gauss-3, kahan-li-8:midpoint (all: discmech list) or FILE.py:NAME"


def add_choices(parser: argparse.ArgumentParser) -> None:
    """Declare what every study is asked."""
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a name or FILE.py:NAME; default: all that apply"
    )
    parser.add_argument(
        "--rule", action="append", default=[], metavar="R", dest="rules", help=RULE_HELP
    )
    parser.add_argument("--retraction", action="append", default=[], metavar="NAME")
    parser.add_argument(
        "--digits",
        action="append",
        default=[],
        metavar="D",
        help="16 is double precision; may be repeated",
    )
    parser.add_argument(
        "--steps", metavar="N", help="of a run; of the coarsest where a study runs several"
    )
    parser.add_argument("--jobs", metavar="N", help="processes side by side (default: one a core)")
    add_fresh(parser)


def add_fresh(parser: argparse.ArgumentParser) -> None:
    """Declare that what was measured before is measured again."""
    parser.add_argument(
        "--fresh", action="store_true", help="measure all anew, also what did not change"
    )


def add_study(parser: argparse.ArgumentParser, name: str) -> None:
    """Declare what the study of that name is asked."""
    add_choices(parser)
    if name in ("symplecticity", "stability"):
        parser.add_argument(
            "--control",
            action="append",
            default=[],
            metavar="NAME",
            help="only this control (a method that must be caught)",
        )
    if name == "work-precision":
        _add_race(parser)
    if name == "extremes":
        parser.add_argument(
            "--extreme", action="append", default=[], metavar="NAME", dest="extremes",
            help='only this one, such as "e = 0.99"',
        )  # fmt: skip
    if name in THOROUGH:
        add_thorough(parser)


def add_thorough(parser: argparse.ArgumentParser) -> None:
    """Declare that time is no matter."""
    parser.add_argument(
        "--thorough", action="store_true",
        help=f"take minutes to hours, not seconds ({', '.join(THOROUGH)})",
    )  # fmt: skip


def _add_race(parser: argparse.ArgumentParser) -> None:
    """What work-precision asks beside scenes and rules; the names are looked up when it runs."""
    parser.add_argument(
        "--peer", action="append", default=[], metavar="P", dest="peers",
        help="DOP853, Radau, LSODA, heyoka, diffrax, diffrax-tsit5, diffrax-symplectic or none "
        "(default: those installed)",
    )  # fmt: skip
    parser.add_argument("--x", metavar="WORK", help="seconds, steps, evaluations, iterations")
    parser.add_argument("--y", metavar="ERROR", help="error, error-x, energy-max, ...")
    parser.add_argument("--periods", metavar="P", help="run over P characteristic periods")
    parser.add_argument(
        "--budget", metavar="SECONDS", help="of timing, a method (default: a fraction of a second)"
    )


def choice_of(options: argparse.Namespace) -> Choice:
    """The choice in objects; raises `BadInput` for unknown names and numbers out of range."""
    from . import controls
    from .case import Choice

    for name in options.retraction:
        retractions.get(name)
    asked = getattr(options, "control", [])
    for name in asked:
        if name not in controls.NAMES:
            raise BadInput(f'there is no control "{name}": there are {", ".join(controls.NAMES)}.')
    peers, axes = _race_choice(options)
    periods = getattr(options, "periods", None)
    return Choice(
        peers=peers,
        axes=axes,
        periods=None if periods is None else count(periods, "--periods", MOST_PERIODS),
        budget=_seconds(getattr(options, "budget", None)),
        thorough=getattr(options, "thorough", False),
        extremes=_extremes(getattr(options, "extremes", [])),
        scenes=lookup.scenes_of(options.scenes),
        rules=lookup.rules(options.rules),
        retractions=tuple(options.retraction),
        digits=tuple(digits_in(d) for d in options.digits),
        steps=None if options.steps is None else count(options.steps, "--steps"),
        controls=tuple(asked),
    )


def jobs(options: argparse.Namespace) -> int | None:
    """Processes side by side, None: one a core."""
    return None if options.jobs is None else count(options.jobs, "--jobs")


def _extremes(names: list[str]) -> tuple[str, ...]:
    if names:
        from .edges import EXTREMES

        known = dict.fromkeys(e.name for several in EXTREMES.values() for e in several)
        for name in names:
            if name not in known:
                shown = ", ".join(f'"{word}"' for word in known)
                raise BadInput(f'there is no extreme "{name}": there are {shown}.')
    return tuple(names)


def _race_choice(options: argparse.Namespace) -> tuple[tuple[str, ...], Any]:
    """Peers and axes, each known."""
    asked = getattr(options, "x", None), getattr(options, "y", None)
    peers = tuple(getattr(options, "peers", ()))
    if peers:
        from .peers import chosen

        chosen(peers)
    if any(asked):
        from .accuracy import METRICS
        from .contest import WORK

        for flag, name, known in zip(("--x", "--y"), asked, (WORK, METRICS), strict=True):
            if name is not None and name not in known:
                raise BadInput(f'{flag} is "{name}": choose {", ".join(known)}.')
    return peers, asked


def _seconds(text: str | None) -> float | None:
    """A time."""
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < math.inf:
        raise BadInput(f"--budget is {text!r}: give seconds, more than 0.")
    return value


def count(text: str, what: str, most: int | None = None) -> int:
    """A whole number from 1, up to `most`."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1 or (most is not None and value > most):
        end = "" if most is None else f" to {most}"
        raise BadInput(f"{what} is {text!r}: give a whole number from 1{end}.")
    return value


def digits_in(text: str) -> int:
    """A precision."""
    value = count(text, "--digits")
    if not 16 <= value <= 10_000:
        raise BadInput(f"--digits is {value}: give 16 (double precision) up to 10000.")
    return value


def as_typed(options: argparse.Namespace) -> str:
    """The words that ask the same again."""
    parts = ["discmech", options.study, *options.scenes]
    for flag, values in (("--rule", options.rules), ("--retraction", options.retraction),
                         ("--digits", options.digits),
                         ("--control", getattr(options, "control", [])),
                         ("--peer", getattr(options, "peers", [])),
                         ("--extreme", getattr(options, "extremes", []))):  # fmt: skip
        parts += [word for value in values for word in (flag, value)]
    for name in ("x", "y", "periods", "budget"):
        if getattr(options, name, None):
            parts += [f"--{name}", getattr(options, name)]
    parts += ["--thorough"] if getattr(options, "thorough", False) else []
    return shlex.join([*parts, *(["--steps", options.steps] if options.steps else [])])
