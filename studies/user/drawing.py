"""`plot`: a result or a run as a matplotlib figure that the user can change."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discmech.integrators.errors import BadInput, shown, unknown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..report.canvas import Panel
    from ..report.figures import Look

KINDS = ("phase", "energy", "base")
MOST_PANELS = 9


def plot(
    thing: Any,
    kind: str | None = None,
    *,
    digits: int | None = None,
    labels: Mapping[str, str] | None = None,
    style: Path | str | None = None,
) -> Figure:
    """Return the figure of a study's result, or of a run, as a matplotlib figure.

    thing: the result of `check`, a trajectory of `flow.trajectory`, or a list of trajectories that
    are drawn together (a phase portrait). kind, for trajectories: "phase" (the default), entry i of
    x against that of μ, or on a group pairs of momenta; "energy", the relative error of the energy
    against time; "base", the path of x (with one coordinate or more than three, each against time).
    digits: selects the figure of a result that has one for each precision (default: the first).
    labels: {rule: text}. style: a .mplstyle file.

    Raises `BadInput` for anything else, and if there is nothing to draw.
    """
    from ..report.canvas import figure_of
    from ..report.figures import sketches

    look = look_of(labels or {}, style)
    if isinstance(thing, Mapping) and "cases" in thing:
        if kind is not None:
            raise BadInput("kind is of trajectories: leave it out for the result of a study.")
        known_rules(labels or {}, [str(case["rule"]) for case in thing["cases"]])
        found = [s for s in sketches(dict(thing), {}, look) if digits in (None, s.digits)]
        if not found:
            raise BadInput(f"the study {thing.get('study')} has no figure of these cases.")
        return figure_of(found[0].panels, found[0].sheet, look.style)
    runs = list(thing) if isinstance(thing, list | tuple) else [thing]
    if not runs or not all(getattr(run, "scheme", None) is not None for run in runs):
        raise BadInput(
            "plot takes what check(...) returns, a trajectory of flow.trajectory(...), or a list "
            f"of trajectories, not {type(thing).__name__} (nor a trajectory that was pickled)."
        )
    if kind is not None and not (isinstance(kind, str) and kind in KINDS):
        raise unknown("kind", kind, KINDS)
    known_rules(labels or {}, [run.scheme.rule.name for run in runs])
    panels = {"phase": _phase, "energy": _energy, "base": _base}[kind or "phase"](
        [_Run(run, look) for run in runs]
    )
    return figure_of(panels[:MOST_PANELS], _sheet(), look.style)


def known_rules(labels: Mapping[str, str], rules: Sequence[str]) -> None:
    """Raise `BadInput` for a label of a rule that is not drawn."""
    for name in labels:
        if name not in rules:
            raise unknown("rule", name, dict.fromkeys(rules))


class _Run:
    """A run with the name and the colour of its rule."""

    def __init__(self, run: Any, look: Look) -> None:
        from ..report.palette import marks

        name = run.scheme.rule.name
        self.scheme, self.t, self.x, self.mu, self.run = run.scheme, run.t, run.x, run.mu, run
        labels = dict(look.labels)
        self.label, self.colour = labels.get(name, name), marks([name])[name].colour
        self.asked = name in labels  # True if the user gave its name


def _curves(axes: Axes, runs: Sequence[_Run], columns: Sequence[tuple[Any, Any]]) -> None:
    """Draw a curve per run; several rules, or labelled ones, have their colours and names."""
    from ..report.palette import THEME, WORDS

    found = {run.label: run.colour for run in runs}
    several, taken = len(found) > 1 or any(run.asked for run in runs), set[str]()
    # a line has no mark to distinguish it from another of its colour
    for label, colour in found.items():
        free = (other for other in (colour, *THEME) if other in WORDS and other not in taken)
        found[label] = next(free, colour)
        taken.add(found[label])
    for run, (across, up) in zip(runs, columns, strict=True):
        own: dict[str, Any] = {"color": found[run.label], "label": run.label} if several else {}
        axes.plot(across, up, lw=0.7, **own)
    if several:
        lines = {str(line.get_label()): line for line in axes.get_lines()}
        axes.legend(lines.values(), lines.keys(), frameon=False, fontsize=7.5, loc="best")


def look_of(labels: Mapping[str, str], style: Path | str | None = None) -> Look:
    """Return the look of figures: labels of rules and a matplotlib style file.

    Raises `BadInput` if the file cannot be read; matplotlib itself logs names and values that it
    does not know.
    """
    from ..report.figures import Look

    if not isinstance(labels, Mapping) or not all(
        isinstance(word, str) for pair in labels.items() for word in pair
    ):
        raise BadInput(f"labels is {shown(labels)}: give a dictionary, rule: text.")
    if style is None:
        return Look(tuple(labels.items()))
    import matplotlib

    if not _is_file(style):
        raise BadInput(
            f"there is no style file {shown(style)}: name a .mplstyle file of matplotlib."
        )
    try:
        given = matplotlib.rc_params_from_file(str(style), use_default_template=False)
    except (ValueError, OSError) as error:
        raise BadInput(f"{style} is no style file of matplotlib: {error}.") from None
    return Look(tuple(labels.items()), tuple((name, given[name]) for name in given))


def _is_file(name: Any) -> bool:
    try:
        return Path(name).is_file()
    except (TypeError, ValueError, OSError):  # no name; a zero byte in it; too long
        return False


def _sheet() -> Any:
    from ..report.canvas import Sheet

    return Sheet(width=2.9, right=0.2)


def _panel(run: Any, subtitle: str, xlabel: str, draw: Callable[[Axes], None]) -> Panel:
    from ..report.canvas import Panel

    scene = run.scheme.scene
    return Panel(scene.title or scene.name, subtitle, xlabel, "", draw)


def _phase(runs: Sequence[Any]) -> list[Panel]:
    x, mu = runs[0].x, runs[0].mu
    if x.ndim != 2:
        raise BadInput("a phase portrait is of a scene, not of a lattice: plot one of its sites.")
    if x.shape[1] == mu.shape[1]:
        pairs = [("x", i, "mu", i) for i in range(mu.shape[1])]
    elif mu.shape[1] > 1:
        m = mu.shape[1]
        pairs = [("mu", i, "mu", (i + 1) % m) for i in range(m if m > 2 else 1)]
    else:
        raise BadInput("x and μ have no entries in pairs here: there is no phase portrait.")
    return [_against(runs, *pair) for pair in pairs]


def _base(runs: Sequence[Any]) -> list[Panel]:
    n = runs[0].x.shape[1] if runs[0].x.ndim == 2 else 0
    if not n:
        raise BadInput("there is no base here: on a group x is empty, and momenta are its phase.")
    if n == 1 or n > 3:  # with four or more coordinates no pair is the path
        return [_against(runs, "t", None, "x", k) for k in range(n)]
    return [_against(runs, "x", i, "x", j) for i in range(n) for j in range(i + 1, n)]


def _against(runs: Sequence[Any], a: str, i: int | None, b: str, j: int | None) -> Panel:
    def draw(axes: Axes) -> None:
        _curves(axes, runs, [(_column(run, a, i), _column(run, b, j)) for run in runs])
        if a == b == "x":
            axes.set_aspect("equal", adjustable="datalim")

    return _panel(runs[0], _name(b, j), _name(a, i), draw)


def _column(run: Any, name: str, k: int | None) -> Any:
    import numpy as np

    values = np.asarray(getattr(run, name), dtype=float)
    return values if k is None else values[:, k]


def _name(letter: str, k: int | None) -> str:
    from ..report.wording import subscript

    return {"mu": "μ"}.get(letter, letter) + ("" if k is None else subscript(k + 1))


def _energy(runs: Sequence[Any]) -> list[Panel]:
    from ..systems.runs import energy_errors

    errors = [energy_errors(run.scheme, run.run, 16) for run in runs]

    def draw(axes: Axes) -> None:
        columns = [(_column(run, "t", None), e) for run, e in zip(runs, errors, strict=True)]
        _curves(axes, runs, columns)

    return [_panel(runs[0], "relative energy error", "t", draw)]
