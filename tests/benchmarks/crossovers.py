"""The page of crossovers: who is fastest at which accuracy, measured anew by one command.

python -m tests.benchmarks.crossovers [FILE.md] [SCENE ...]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from discmech.integrators import BadInput, rules, scenes
from discmech.integrators.scene import Scene
from discmech.studies.command.output import writable
from discmech.studies.core.case import Choice
from discmech.studies.core.record import machine, versions
from discmech.studies.core.study import every_study
from discmech.studies.report.wording import NONE, duration, scientific
from discmech.studies.work_precision.peers import chosen
from discmech.studies.work_precision.standings import REACHED, cost
from tests.studies.as_json import run_study

COMMAND = "python -m tests.benchmarks.crossovers"
RULES = ("trapezoidal", "gauss-8", "gauss-10")
FAST = ("heyoka", "WHFast", "IAS15")  # the peers that the page is about
#: where nobody asks for others
SCENES = ("pendulum", "kepler", "henon-heiles", "double-pendulum", "rigid-body", "heavy-top",
          "lagrange-top", "spherical-pendulum", "outer-solar-system")  # fmt: skip
PERIODS = 10_000
LASTING = ("pendulum", "kepler", "heavy-top")  # of these the races over many periods
LENGTHS = {"outer-solar-system": 100_000}  # days, where others run to T = 100
BUDGETS = {"own": 0.05, "long": 0.15, "periods": 1.5}  # seconds a method

_Cases = Sequence[dict[str, Any]]
_HEAD = f"""# crossovers: who is fastest, and where it changes

Made by `{COMMAND}`, on {{machine}}.
Processor time, one race a scene: read ratios, not seconds. What stands behind them, published
figures and how far two runs agree: [races](../notes/races.md). The rules are
{", ".join(RULES)}, those
with stages also with steps chosen by tolerance; the peers {{peers}}, each by its own settings.

A cell has the fastest rule and the fastest of these peers that come to an error of 10⁻⁴, 10⁻⁸,
10⁻¹², and the peer's time over the rule's: above 1 (bold) the rule is faster. A dash: none of them
does within the budget.
"""


def page(names: Sequence[str], told: Callable[[str], None] = lambda line: None) -> str:
    """The page for these scenes; `told` hears of each race."""
    peers = tuple(p for p in chosen(())[0] if p in FAST) or ("DOP853",)
    texts = [_HEAD.format(machine=_where(), peers=", ".join(peers))]
    texts.append("## At the end of a scene's own duration, error in (x, μ)\n")
    texts.append(_accuracies(_race(scenes.get(name), peers, "own", told) for name in names))
    texts.append(
        "## At a longer time, error in (x, μ)\n\nThe floor is the "
        "error that rounding the start alone makes: what is below it was lucky.\n"
    )
    texts.append(_accuracies(_race(_longer(name), peers, "long", told) for name in names))
    over = [_race(scenes.get(name), peers, "periods", told) for name in names if name in LASTING]
    texts.append(f"## Over {PERIODS} characteristic periods, largest energy error\n")
    texts.append(_accuracies(over, "energy-max"))
    texts.append(
        f"## Over {PERIODS} characteristic periods, what is kept\n\nThe smallest of the largest "
        "errors of a run, and of drifts of what is kept to round-off (momenta, Casimirs).\n"
    )
    texts.append(_kept(over))
    return "\n".join(texts)


def _where() -> str:
    """Processor, cores and versions; of the machine nothing else."""
    found = {**versions(), **machine()}
    packages = ("python", "numpy", "scipy", "heyoka", "rebound")
    words = ", ".join(f"{name} {found[name]}" for name in packages if found.get(name))
    return f"{found['cpu']}, {found['cores']} cores ({words})"


def _longer(name: str) -> Scene:
    return scenes.get(name).with_values(duration=LENGTHS.get(name, 100))


def _race(scene: Scene, peers: tuple[str, ...], kind: str, told: Callable[[str], None]) -> _Cases:
    told(f"{scene.name}, {kind}")
    own = [("peer", peers), ("budget", BUDGETS[kind])]
    own += [("periods", PERIODS)] if kind == "periods" else []
    choice = Choice((scene,), tuple(map(rules.get, RULES)), own=tuple(own))
    return run_study(every_study()["work-precision"], choice)["cases"]


def _accuracies(races: Iterable[_Cases], metric: str = "error") -> str:
    """A line a scene, a column an accuracy; and where the fastest change places."""
    long = metric != "error"
    head = ["", *(f"to {scientific(a)}" for a in REACHED), "crossover", "" if long else "floor"]
    lines = [head[: 5 if long else 6], ["---"] * (5 if long else 6)]
    for cases in races:
        first = cases[0]
        line = [f"{first['scene']}, T = {first['duration']:.6g}"]
        line += [_cell(cases, accuracy, metric) for accuracy in REACHED]
        found = [f"{scientific(c['error'])}: {c['tighter']} below" for c in first["crossovers"]]
        line.append("; ".join(found) or NONE)
        lines.append(line if long else [*line, scientific(first["floor"][metric])])
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _cell(cases: _Cases, accuracy: float, metric: str) -> str:
    """The fastest rule and the fastest peer, and the ratio of their times."""
    best: dict[str, tuple[float, str]] = {}
    for case in cases:
        (seconds,) = cost(case["rows"], ("seconds", metric), (accuracy,)).values()
        if seconds is not None:
            here = (seconds, case["rule"])
            best[case["kind"]] = min(best.get(case["kind"], here), here)
    words = [
        f"{best[k][1]} {duration(best[k][0])}" if k in best else NONE for k in ("rule", "peer")
    ]
    if len(best) < 2:
        return ", ".join(words)
    ratio = best["peer"][0] / best["rule"][0]
    shown = f"{ratio:.2g}"
    return f"{', '.join(words)}: {f'**{shown}**' if ratio > 1 else shown}"


def _kept(races: Iterable[_Cases]) -> str:
    """A line a scene: the least energy error and drift of rules with stages, and of peers."""
    lines = [["", "energy: rules", "peers", "momenta, Casimirs: rules", "peers"], ["---"] * 5]
    for cases in races:
        line = [f"{cases[0]['scene']}, T = {cases[0]['duration']:.6g}"]
        for metric in ("energy-max", "momentum-max"):
            for kind in ("rule", "peer"):
                found = [
                    (row[metric], case["rule"], row["setting"]) for case in cases
                    if case["kind"] == kind for row in case["rows"] if row[metric] is not None
                ]  # fmt: skip
                least = min(found, default=None)
                line.append(NONE if least is None else f"{scientific(least[0])} ({least[1]})")
        lines.append(line)
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def main(arguments: Sequence[str]) -> None:
    """Write the page into the file, or to standard output; exits with 2 at a word that is wrong."""
    parser = argparse.ArgumentParser(prog="crossovers", description=main.__doc__)
    parser.add_argument("words", nargs="*", metavar="FILE.md | SCENE", help="a page, and scenes")
    words = parser.parse_args(arguments).words
    files = [word for word in words if word.endswith(".md")]
    names = [word for word in words if word not in files]
    try:
        if len(files) > 1:
            raise BadInput(f"one page is written, not {len(files)}: {', '.join(files)}.")
        for name in names:
            scenes.get(name)
        writable(next(iter(files), None))
    except BadInput as refusal:
        parser.error(str(refusal))
    text = page(names or SCENES, lambda line: print(line, file=sys.stderr, flush=True))
    if files:
        Path(files[0]).write_text(text, encoding="utf-8")
    else:
        print(text)


if __name__ == "__main__":
    main(sys.argv[1:])
