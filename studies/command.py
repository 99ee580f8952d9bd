"""The command `discmech`: list, run, the studies, and the report.

Only what the asked command needs is loaded: `discmech list` imports neither sympy nor numba.
"""

from __future__ import annotations

import argparse
import json
import re
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from integrators import BadInput, StepFailure, discretisations, retractions, scenes

from . import NAMES, references
from .output import console, progress_shown, writable, write

PASS, FAIL, BAD_INPUT, INCONCLUSIVE, INTERRUPTED = 0, 1, 2, 3, 130
EXIT = {"pass": PASS, "fail": FAIL, "inconclusive": INCONCLUSIVE}
RULE_HELP = "e.g. midpoint, gauss-3, lobatto-4, kahan-li-8:midpoint; all: discmech list"
GROUPOIDS = ("pair", "lie_group", "action", "product", "LocalGroupoid")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns 0 pass, 1 fail, 2 bad input, 3 inconclusive."""
    options = _parser().parse_args(arguments)
    try:
        return int(options.action(options))
    except BadInput as error:
        print(f"discmech: {error}", file=sys.stderr)
        return BAD_INPUT
    except StepFailure as error:
        print(f"discmech: {error}", file=sys.stderr)
        return FAIL
    except BrokenPipeError:
        sys.stderr.close()
        return PASS
    except KeyboardInterrupt:
        again = "" if options.action is _run else "; the same command goes on where it stopped"
        print(f"discmech: interrupted{again}.", file=sys.stderr)
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="discmech",
        description="Verification bench for variational integrators on Lie groupoids.",
        epilog="Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive.",
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    listing = commands.add_parser("list", help="names of scenes, rules, groupoids and studies")
    listing.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    listing.set_defaults(action=_list)

    run = commands.add_parser("run", help="one trajectory of a scene")
    run.add_argument("scene")
    run.add_argument("--rule", default="trapezoidal", metavar="R", help=RULE_HELP)
    run.add_argument("--step", metavar="H", help='exact: "0.01" is 1/100 (default: the scene\'s)')
    run.add_argument("--steps", metavar="N", help="default: the scene's duration")
    run.add_argument("--every", metavar="K", default="1", help="keep every K-th row (default 1)")
    run.add_argument("--digits", metavar="D", default="16")
    run.add_argument("--retraction", metavar="NAME")
    run.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
    # "-1/10" and "-1e-3" are numbers too, not flags
    run._negative_number_matcher = re.compile(r"^-[\d.]+([eE/][-+]?\d+)?$")
    run.set_defaults(action=_run)

    about = {
        "order": "order of accuracy against certified references",
        "symplecticity": "pullback of Ω and Poisson form, with controls",
        "momentum": "momentum maps and Casimirs over 10⁶ steps",
        "energy": "energy band and secular slope over 10⁶ steps",
        "work-precision": "error against run time, beside other people's integrators",
        "extremes": "what happens at the edge of each scene, and how it is noticed",
        "savings": "what leaving out work that a scene does not need is worth",
        "stability": "linear intervals, and maps of stiff scenes over step and stiffness",
    }
    for name in NAMES:
        study = commands.add_parser(name, help=about[name])
        _choices(study)
        if name in ("symplecticity", "stability"):
            study.add_argument(
                "--control",
                action="append",
                default=[],
                metavar="NAME",
                help="only this control (a method that must be caught)",
            )
        if name == "work-precision":
            _race_options(study)
        if name == "extremes":
            study.add_argument(
                "--extreme", action="append", default=[], metavar="NAME", dest="extremes",
                help='only this one, such as "e = 0.99"',
            )  # fmt: skip
        if name in ("work-precision", "stability", "savings"):
            study.add_argument("--thorough", action="store_true", help="as long as it takes")
        study.add_argument("--json", metavar="FILE", help="write JSON (- for standard output)")
        study.set_defaults(action=_study, study=name)

    references.add_to(commands)
    report = commands.add_parser("report", help="all studies on one page with its figures")
    _choices(report)
    report.add_argument("--folder", default="reports/build", help="default: reports/build")
    report.set_defaults(action=_report)
    return parser


def _race_options(parser: argparse.ArgumentParser) -> None:
    """What work-precision asks beside scenes and rules; the names are looked up when it runs."""
    parser.add_argument(
        "--peer", action="append", default=[], metavar="P", dest="peers",
        help="DOP853, Radau, LSODA, heyoka, diffrax or none (default: those installed)",
    )  # fmt: skip
    parser.add_argument("--x", metavar="WORK", help="seconds, steps, evaluations, iterations")
    parser.add_argument("--y", metavar="ERROR", help="error, error-x, energy-max, ...")
    parser.add_argument("--periods", metavar="P", help="run over P characteristic periods")


def _choices(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="default: all that apply")
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
    parser.add_argument("--steps", metavar="N")
    parser.add_argument("--jobs", metavar="N", help="processes side by side (default: one a core)")


def _choice(options: argparse.Namespace) -> Any:
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
        periods=None if periods is None else _count(periods, "--periods"),
        thorough=getattr(options, "thorough", False),
        extremes=_extremes(getattr(options, "extremes", [])),
        scenes=tuple(scenes.get(name) for name in options.scenes),
        rules=tuple(discretisations.get(name) for name in options.rules),
        retractions=tuple(options.retraction),
        digits=tuple(_digits(d) for d in options.digits),
        steps=None if options.steps is None else _count(options.steps, "--steps"),
        controls=tuple(asked),
    )


def _jobs(options: argparse.Namespace) -> int | None:
    return None if options.jobs is None else _count(options.jobs, "--jobs")


def _extremes(names: list[str]) -> tuple[str, ...]:
    if names:
        from .extremes import EXTREMES

        known = {extreme.name for several in EXTREMES.values() for extreme in several}
        for name in names:
            if name not in known:
                raise BadInput(f'there is no extreme "{name}": there are {", ".join(known)}.')
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


def _count(text: str, what: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise BadInput(f"{what} is {text!r}: give a whole number from 1.")
    return value


def _digits(text: str) -> int:
    value = _count(text, "--digits")
    if not 16 <= value <= 10_000:
        raise BadInput(f"--digits is {value}: give 16 (double precision) up to 10000.")
    return value


# -- actions --------------------------------------------------------------------------------


def _list(options: argparse.Namespace) -> int:
    found = {"scenes": list(scenes.names()), "rules": list(discretisations.names()),
             "groupoids": list(GROUPOIDS), "studies": list(NAMES)}  # fmt: skip
    if options.json:
        write(options.json, json.dumps(found, indent=1))
        return PASS
    for kind, names in found.items():
        print(f"{kind}:")
        for name in names:
            title = scenes.get(name).title if kind == "scenes" else ""
            print(f"  {name:<16}{title}".rstrip())
    return PASS


def _run(options: argparse.Namespace) -> int:
    from integrators import Scheme
    from integrators.exact import exact_rational

    scene, rule = scenes.get(options.scene), discretisations.get(options.rule)
    if options.retraction:
        scene = scene.with_retraction(retractions.get(options.retraction))
    step = exact_rational(scene.step if options.step is None else options.step, "--step")
    digits, every = _digits(options.digits), _count(options.every, "--every")
    scheme = Scheme(scene, rule)
    flow = scheme.flow(step, digits)
    steps = _count(options.steps, "--steps") if options.steps else scene.steps_for(abs(step))
    failure = None
    begun = time.perf_counter()
    with progress_shown() as show:
        try:
            run = flow.trajectory(
                steps,
                every,
                progress=lambda done: show(f"{scene.name}: {done} steps", done / steps),
            )
        except StepFailure as error:
            run, failure = error.trajectory, error
            if run is None:
                raise
    seconds = time.perf_counter() - begun

    def numbers(array: Any) -> Any:
        return (
            array.tolist()
            if digits == 16
            else [
                _decimal(e, digits) if array.ndim == 1 else [_decimal(v, digits) for v in e]
                for e in array
            ]
        )

    found = {
        "schema": 1, "scene": scene.name, "rule": rule.name,
        "retraction": scene.groupoid.retraction, "digits": digits,
        "step": float(step), "steps": run.steps,
        "t": numbers(run.t), "x": numbers(run.x), "u": numbers(run.u), "mu": numbers(run.mu),
        "newton": {"mean": run.newton_mean, "max": run.newton_max},
        "seconds": seconds, "failure": None if failure is None else str(failure),
    }  # fmt: skip
    if options.json:
        write(options.json, json.dumps(found))
    if options.json != "-":
        _print_run(found)
    if failure is not None:
        raise failure
    return PASS


def _decimal(value: Any, digits: int) -> str:
    import mpmath

    return str(mpmath.nstr(value, digits, min_fixed=-5, max_fixed=15))


def _print_run(run: dict[str, Any]) -> None:
    print(f"{run['scene']} by {run['rule']}: {run['steps']} steps of {run['step']:.6g} "
          f"in {run['seconds']:.3g} s (with compilation, if it was the first time)")  # fmt: skip
    print(
        f"Newton corrections a step: {run['newton']['mean']:.3f} mean, {run['newton']['max']} most"
    )
    if not run["t"]:
        return
    for name in ("x", "u", "mu"):
        if run[name][-1]:
            print(f"{name:>3} at t = {float(run['t'][-1]):.6g}: "
                  + "  ".join(str(v) for v in run[name][-1]))  # fmt: skip


def _study(options: argparse.Namespace) -> int:
    from . import get
    from .rendering.tables import plain, terminal_table
    from .running import run_study

    choice = _choice(options)
    writable(options.json)
    with progress_shown() as show:
        result = run_study(get(options.study), choice, show, keep=True, jobs=_jobs(options))
    result["command"] = _as_typed(options)
    if options.json:
        write(options.json, json.dumps(plain(result), ensure_ascii=False, allow_nan=False))
    if options.json != "-":
        console().print(terminal_table(result))
        for note in result["notes"]:
            print(note)
    return EXIT[result["verdict"]]


def _as_typed(options: argparse.Namespace) -> str:
    parts = ["discmech", options.study, *options.scenes]
    for flag, values in (("--rule", options.rules), ("--retraction", options.retraction),
                         ("--digits", options.digits),
                         ("--control", getattr(options, "control", [])),
                         ("--peer", getattr(options, "peers", [])),
                         ("--extreme", getattr(options, "extremes", []))):  # fmt: skip
        parts += [word for value in values for word in (flag, value)]
    for name in ("x", "y", "periods"):
        if getattr(options, name, None):
            parts += [f"--{name}", getattr(options, name)]
    parts += ["--thorough"] if getattr(options, "thorough", False) else []
    return shlex.join([*parts, *(["--steps", options.steps] if options.steps else [])])


def _report(options: argparse.Namespace) -> int:
    from .report import make_report

    choice = _choice(options)
    try:
        Path(options.folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(
            f"{options.folder} cannot be written ({error.strerror}); name another --folder."
        ) from None
    with progress_shown() as show:
        results, page = make_report(choice, Path(options.folder), show, _jobs(options))
    from .case import worst
    from .rendering.tables import terminal_table

    screen = console()
    for result in results:
        screen.print(terminal_table(result))
    screen.print(f"report: {page}", highlight=False, soft_wrap=True)
    return EXIT[worst(r["verdict"] for r in results)]


if __name__ == "__main__":
    sys.exit(main())
