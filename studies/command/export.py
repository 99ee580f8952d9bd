"""`discmech export SCENE RULE`: a scheme as one file to take home, checked beside its original."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from discmech.integrators import BadInput

from ..core import lookup
from ..core.options import digits_in, option_words
from ..core.outcome import worst
from .options import RULE_HELP, scene_asked
from .output import EXIT, progress_shown, write

if TYPE_CHECKING:
    from ..user.exports import Beside, Verdicts

LANGUAGES = ("c", "numpy", "julia", "jax")


def add_to(commands: Any) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "export", help="a scheme as one file of code",
        epilog="Exit codes: 0 written, and alike where it was checked; 1 it differs; 2 bad input, "
        "or it cannot be exported; 3 round-off hides the difference; 4 it could not be built.",
    )  # fmt: skip
    parser.add_argument("scene", help="a name or FILE.py:NAME")
    parser.add_argument("rule", help=RULE_HELP)
    parser.add_argument("--language", required=True, choices=LANGUAGES)
    parser.add_argument("--retraction", metavar="NAME")
    parser.add_argument("--digits", metavar="D", default="16", help="16: a file has doubles")
    parser.add_argument("--out", metavar="FILE", help="default: standard output")
    parser.add_argument(
        "--check", action=argparse.BooleanOptionalAction, default=None,
        help="run the file beside its original: trajectories, verdicts, cost (default: "
        "trajectories alone, where the language is here)",
    )  # fmt: skip
    parser.add_argument(
        "--harness", action="store_true", help="with an adapter that answers JSON lines"
    )
    parser.set_defaults(action=_export)


def _export(options: argparse.Namespace) -> int:
    from discmech.integrators import Scheme, scenes
    from discmech.integrators.extensions.export import export, exportable
    from discmech.integrators.extensions.foreign.box import no_motion

    from ..user import exports

    if digits_in(options.digits) != 16:
        raise BadInput(
            f"a file computes with doubles, so {options.digits} digits cannot be exported: leave "
            f"--digits out, or say discmech run --digits {options.digits}."
        )
    if lookup.problem_named(options.scene) is not None and options.scene not in scenes.NAMES:
        raise BadInput(
            f"{options.scene} is a problem of optimal control, whose controls belong to a run "
            f"and not to a step, so it cannot be exported: discmech run {options.scene} --folder "
            "FOLDER writes states and controls as a table."
        )
    scene = scene_asked(options, lattices=True)
    if getattr(scene, "lagrangian", None) is no_motion:
        raise BadInput(
            f"{options.scene} holds the states of a map, which is code already and whose motion is "
            "in no scene, so it cannot be exported."
        )
    scheme = Scheme(scene, lookup.rule(options.rule))
    scheme = exportable(scheme, options.language != "jax")
    said = [f"Command: {_typed(options)}"]
    verdict = "pass"
    with progress_shown("deriving") as show:
        tried = export(scheme, options.language, True)
        why = exports.missing(options.language)
        if options.check is None and why:
            print(f"discmech: {why}, so the file was not checked.", file=sys.stderr)
        elif options.check is not False:
            with TemporaryDirectory() as folder:
                box = exports.boxed(scheme, exports.built(tried, options.language, Path(folder)))
                run = exports.beside(scheme, box, progress=show)
                lines = [_of_run(run)]
                # the studies ask programs for runs of scenes
                asked = options.check and not hasattr(scheme, "lattice")
                verdicts = exports.verdicts(scheme, box, show) if asked else []
                lines += map(_of_study, verdicts)
                if options.check:
                    lines.append(_of_cost(*exports.cost(scheme, box)))
            alike = all(e.alike for e in verdicts)
            verdict = worst([run.verdict, "pass" if alike else "fail"])
            said.append(f"Verified beside the original, {verdict}: {' '.join(lines)}")
            for line in lines:
                print(line, file=sys.stderr)
    text = export(scheme, options.language, options.harness, said)
    write(options.out or "-", text.rstrip("\n"))
    return EXIT[verdict]


def _of_run(run: Beside) -> str:
    why = f" ({run.reason})" if run.reason else ""
    return (f"trajectory: {run.verdict} over {run.steps} steps, the largest difference is "
            f"{run.worst:.2g} of what round-off explains{why}.")  # fmt: skip


def _of_study(verdicts: Verdicts) -> str:
    why = f" ({verdicts.reason})" if verdicts.reason and not verdicts.alike else ""
    return f"{verdicts.study}: {verdicts.exported}, the original: {verdicts.original}{why}."


def _of_cost(own: float, original: float) -> str:
    return (f"cost: {own * 1e9:.3g} ns a step, {own / original:.2f} times the original's "
            f"{original * 1e9:.3g} ns.")  # fmt: skip


def _typed(options: argparse.Namespace) -> str:
    flags = {"--language": options.language, "--retraction": options.retraction,
             "--harness": options.harness}  # fmt: skip
    return shlex.join(["discmech", "export", options.scene, options.rule, *option_words(flags)])
