"""The command-line options of a study: scenes, rules, precisions, and its own."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from discmech.integrators import BadInput, retractions

from ..core import lookup
from ..core.environment import absolute
from ..core.options import Option, digits_in, option_words, values_of, whole

if TYPE_CHECKING:
    from discmech.integrators import Scene
    from discmech.integrators.rules import Discretisation

    from ..core.case import Choice
    from ..core.cluster import Cluster
    from ..report.figures import Look

RULE_HELP = "midpoint, gauss-3, kahan-li-8:midpoint (all: discmech list) or FILE.py:NAME"


def add_choices(parser: argparse.ArgumentParser, of_scenes: bool = True) -> None:
    """Declare the options of every study; a study without scenes has none for these."""
    if not of_scenes:
        add_jobs(parser)
        parser.set_defaults(scenes=[], rules=[], retraction=[], digits=[], steps=None, vary=None)
        return
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help="a name or FILE.py:NAME; default: all that apply"
    )
    parser.add_argument(
        "--rule", action="append", default=[], metavar="R", dest="rules", help=RULE_HELP
    )
    add_numbers(parser)


def add_numbers(parser: argparse.ArgumentParser) -> None:
    """Declare the options for charts, precisions, steps, values, and processes."""
    parser.add_argument(
        "--vary", metavar="W=A:B:N",
        help="N values from A to B for a number that the rule leaves open, or a scene's parameter",
    )  # fmt: skip
    parser.add_argument(
        "--retraction", action="append", default=[], metavar="NAME",
        help="the chart of scenes on groups; may be repeated, to set charts side by side",
    )  # fmt: skip
    parser.add_argument(
        "--digits", action="append", default=[], metavar="D",
        help="16 is double precision; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--steps", metavar="N", help="number of steps (of the coarsest run, if there are several)"
    )
    add_jobs(parser)


def _chosen(options: argparse.Namespace) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Return the scenes and the rules, or those that --vary makes of them."""
    if options.vary is None:
        return lookup.scenes_of(options.scenes), lookup.rules(options.rules)
    return lookup.varied(options.scenes, options.rules, *values_of(options.vary))


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Declare the options for the measuring processes, which `jobs` reads, and --fresh."""
    add_fresh(parser)
    parser.add_argument("--jobs", metavar="N", help="number of processes (default: one per core)")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS",
        help="measure on the workers of this Dask scheduler (tcp://host:8786)",
    )  # fmt: skip


def add_fresh(parser: argparse.ArgumentParser) -> None:
    """Declare the option to measure everything again."""
    parser.add_argument(
        "--fresh", action="store_true", help="measure everything again, even if it did not change"
    )


def add_folder(parser: argparse.ArgumentParser) -> None:
    """Declare the options for a page with its files, and for the look of its figures."""
    parser.add_argument(
        "--folder", metavar="DIR",
        help="write a page here, with figures (SVG, PDF, PNG) and tables (CSV, TeX, JSON)",
    )  # fmt: skip
    add_look(parser)


def add_look(parser: argparse.ArgumentParser) -> None:
    """Declare the options for the look of figures; `look_of` reads them."""
    parser.add_argument(
        "--label", action="append", default=[], metavar="RULE=TEXT", dest="labels",
        help="the name of a rule in figures and tables of a page; may be repeated",
    )  # fmt: skip
    parser.add_argument("--style", metavar="FILE", help="a style file of matplotlib, for figures")


def look_of(options: argparse.Namespace, rules: Sequence[Discretisation]) -> Look:
    """Return the requested look of figures.

    A rule has its name or its word, FILE.py:NAME; its label is that of all its values of --vary,
    too. Raises `BadInput` for one without
    "=" or with a rule that was not chosen, and for an unreadable style.
    """
    from ..core.words import address_of
    from ..user import drawing

    labels: dict[str, str] = {}
    for label in options.labels:
        words = {word: e.name for e in rules for word in (e.name, address_of(e))}
        known = [word for word in words if label.startswith(f"{word}=")]  # one may have an "="
        word = max(known, key=len, default=label.partition("=")[0])
        rule, equals, text = words.get(word, word), label[len(word) :][:1], label[len(word) + 1 :]
        if not (rule and equals and text):
            raise BadInput(f"--label {label} names no rule and text: write --label midpoint=Gauss.")
        number = f"{rule}:{(options.vary or '').partition('=')[0]}="
        values = [e.name for e in rules if e.name.startswith(number)]
        labels |= {name: text + name[len(rule) :] for name in values} or {rule: text}
    if rules:
        drawing.known_rules(labels, [rule.name for rule in rules])
    return drawing.look_of(labels, options.style and absolute(options.style))


def add_own(parser: argparse.ArgumentParser, options: Sequence[Option]) -> None:
    """Declare a study's own options; `choice_of` and `as_typed` read them."""
    parser.set_defaults(own=tuple(options))
    for option in options:
        if option.metavar is None:
            parser.add_argument(option.flag, action="store_true", help=option.help)
        elif option.repeated:
            parser.add_argument(
                option.flag, action="append", default=[], metavar=option.metavar, help=option.help
            )
        else:
            parser.add_argument(option.flag, metavar=option.metavar, help=option.help)


def choice_of(options: argparse.Namespace) -> Choice:
    """Return the choice in objects; raises `BadInput` for unknown names or bad numbers."""
    from ..core.case import Choice

    for name in options.retraction:
        retractions.get(name)
    scenes, rules = _chosen(options)
    return Choice(
        own=own_of(options),
        scenes=scenes or lookup.boxes(rules),
        rules=rules or lookup.maps_of(options.scenes),
        retractions=tuple(options.retraction),
        digits=tuple(dict.fromkeys(map(digits_in, options.digits))),
        steps=None if options.steps is None else whole("--steps")(options.steps),
    )


def own_of(options: argparse.Namespace) -> tuple[tuple[str, Any], ...]:
    """Return the values of a study's own options, by name; raises `BadInput` like their readers."""
    asked: list[tuple[str, Any]] = []
    for option in options.own:
        value = getattr(options, option.name)
        if value not in (None, [], False):
            read = (tuple(map(option.read, value)) if option.repeated
                    else value if option.metavar is None else option.read(value))  # fmt: skip
            asked.append((option.name, read))
    return tuple(asked)


def jobs(options: argparse.Namespace) -> int | Cluster | None:
    """Return the number of processes, None for one per core, or the workers of a cluster."""
    if options.scheduler is not None:
        from ..core.cluster import Cluster

        if options.jobs is not None:
            raise BadInput("--jobs counts processes here, --scheduler has its own: give one.")
        return Cluster(options.scheduler)
    return None if options.jobs is None else whole("--jobs")(options.jobs)


def scene_asked(options: argparse.Namespace, lattices: bool = False) -> Scene:
    """Return the scene, in the requested retraction; raises `BadInput` like `lookup.scene`.

    lattices: whether a lattice is accepted, too.
    """
    scene = lookup.scene_given(options.scene) if lattices else lookup.scene(options.scene)
    if options.retraction:
        return scene.with_retraction(retractions.get(options.retraction))
    return scene


def add_rule(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Declare one rule: the word after the scene, or that of --rule."""
    parser.add_argument("named", nargs="?", metavar="RULE", help=RULE_HELP + more)
    parser.add_argument("--rule", metavar="R", help="the rule, in place of RULE")


def rule_asked(options: argparse.Namespace, usual: str | None = None) -> str:
    """Return the word of the rule; raises `BadInput` for two, and for none without a usual one."""
    named = [word for word in (options.named, options.rule) if word is not None]
    if len(named) > 1 or not (named or usual):
        raise BadInput("say one rule: the word after the scene, or --rule RULE.")
    return str(named[0] if named else usual)


def page_of(options: argparse.Namespace, command: str) -> str:
    """Return the command that makes the page again, with its folder and the look of its figures."""
    flags = {
        "--bench": getattr(options, "bench", False), "--folder": options.folder,
        "--label": options.labels, "--style": options.style,
    }  # fmt: skip
    return " ".join([command, *map(shlex.quote, option_words(flags))])


def as_typed(options: argparse.Namespace) -> str:
    """Return the command that asks for the same again."""
    own = {option.flag: getattr(options, option.name) for option in options.own}
    flags = {
        "--rule": options.rules, "--vary": options.vary, "--retraction": options.retraction,
        "--digits": options.digits, **own, "--steps": options.steps,
    }  # fmt: skip
    return shlex.join(["discmech", options.study, *options.scenes, *option_words(flags)])
