"""`plot`: a result or a run as a matplotlib figure that the user can change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discmech.integrators.errors import BadInput, shown, unknown

from ..core.words import names_apart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..report.canvas import Panel
    from ..report.figures import Look

KINDS = ("phase", "energy", "base", "time", "control")
MOST_PANELS = 9
ROUNDED = 1e-12  # of the largest entry: changes below it are round-off of a run
COMPARED = 500  # points of a curve by which it is seen whether it coincides with another


def plot(
    thing: Any,
    kind: str | None = None,
    *,
    digits: int | None = None,
    wrap: bool | Sequence[int] = (),
    labels: Mapping[str, str] | None = None,
    style: Path | str | None = None,
) -> Figure:
    """Return the figure of a study's result, or of a run, as a matplotlib figure.

    thing: the result of `check`, a trajectory of `flow.trajectory` (of a scene or a lattice), a
    motion of `control.solve`, or a list of these that are drawn together (a phase portrait).

    kind, for runs: "phase" (the default), entry i of x against that of μ, of a Lagrangian that is
    linear in v pairs of entries of x, or on a group pairs of momenta; "energy", the relative error
    of the energy against time (with contact or a force its change); "base", the path of x, or of
    the place in it (with one coordinate or more than three, as "time"); "time", each coordinate
    that moves against time, the
    sites of a lattice together in colours by their numbers; "control" (the default of a motion that
    was steered), each control against time. Of more than nine panels nine are drawn, which their
    names tell.

    digits: selects the figure of a result that has one for each precision (default: the first).
    wrap: the entries of x that are angles, as [0], or True for all; they are shown in (−π, π].
    labels: {rule: text}. style: a .mplstyle file.

    Raises `BadInput` for anything else, and if there is nothing to draw.
    """
    from ..core.result import study_result_of
    from ..report.canvas import figure_of
    from ..report.figures import sketches
    from ..report.palette import marks

    look = look_of(labels or {}, style)
    if isinstance(thing, Mapping) and "cases" in thing:
        if kind is not None:
            raise BadInput("kind is of trajectories: leave it out for the result of a study.")
        result = study_result_of(thing)
        known_rules(labels or {}, [str(case.rule) for case in result.cases])
        drawings = [s for s in sketches(result, {}, look) if digits in (None, s.digits)]
        if not drawings:
            raise BadInput(f"the study {result.study} has no figure of these cases.")
        return figure_of(drawings[0].panels, drawings[0].sheet, look.style)
    runs = list(thing) if isinstance(thing, list | tuple) else [thing]
    if not runs or any(subject_of(run) is None for run in runs):
        raise BadInput(
            "plot takes what check(...) returns, a trajectory of flow.trajectory(...), a motion of "
            f"control.solve(...), or a list of these, not {type(thing).__name__} (nor a "
            "trajectory that was pickled)."
        )
    if kind is not None and not (isinstance(kind, str) and kind in KINDS):
        raise unknown("kind", kind, KINDS)
    if len({(run.x.shape[1:], run.mu.shape[1:]) for run in runs}) > 1:
        raise BadInput("runs of scenes with other numbers of coordinates cannot be drawn together.")
    names = names_apart([(subject_of(run) or (None, None))[1] for run in runs])
    drawn = [_Run(run, name, look, _angles(wrap, run.x.shape[-1]))
             for run, name in zip(runs, names, strict=True)]  # fmt: skip
    known_rules(labels or {}, [run.rule for run in drawn])
    known = marks(dict.fromkeys(run.rule for run in drawn))
    for run in drawn:
        run.mark = known[run.rule]
    usual = "phase" if drawn[0].controls is None else "control"
    panels = {
        "phase": _phase, "energy": _energy, "base": _base, "time": _time, "control": _control,
    }[kind or usual](drawn)  # fmt: skip
    chosen = {len(panels) * k // MOST_PANELS for k in range(MOST_PANELS)}
    if len(panels) > MOST_PANELS:
        panels = [panel for k, panel in enumerate(panels) if k in chosen]
    panels[1:] = [replace(panel, title="") for panel in panels[1:]]  # it is that of all
    return figure_of(panels, _sheet(), look.style)


def subject_of(run: Any) -> tuple[Any, Any] | None:
    """Return (scene or lattice, rule) of a trajectory or a steered motion; None for all else."""
    made: Any = getattr(run, "scheme", None) or run  # a steered motion has them itself
    subject = getattr(made, "scene", None) or getattr(made, "lattice", None)
    return None if subject is None else (subject, getattr(made, "rule", None))


def _angles(wrap: Any, entries: int) -> tuple[int, ...]:
    """Return the entries of x that are angles."""
    choice = range(entries) if wrap is True else () if wrap is False else wrap
    try:
        angles = [*choice]
    except TypeError:
        angles = [wrap]
    if not all(type(k) is int and 0 <= k < entries for k in angles):
        raise BadInput(
            f"wrap is {shown(wrap)}: name the entries of x that are angles, as [0], or say True."
        )
    return tuple(angles)


def known_rules(labels: Mapping[str, str], rules: Sequence[str]) -> None:
    """Raise `BadInput` for a label of a rule that is not drawn."""
    for name in labels:
        if name not in rules:
            raise unknown("rule", name, dict.fromkeys(rules))


class _Run:
    """A run with the name and the look of its rule.

    x and mu have the shape (r, sites, n): of a scene there is one site. The impacts of a scene are
    rows too, without momenta, which jump there. moving: the sites that are not fixed.
    """

    def __init__(self, run: Any, rule: str, look: Look, angles: tuple[int, ...]) -> None:
        import numpy as np

        self.subject: Any
        self.mark: Any = None
        self.subject = (subject_of(run) or (None,))[0]
        self.rule, self.run, self.angles = rule, run, angles
        self.t = np.asarray(run.t, dtype=float)
        self.lattice = run.x.ndim == 3
        parts = [np.asarray(part, dtype=float) for part in (run.x, run.mu)]
        self.x, self.mu = (part if self.lattice else part[:, None] for part in parts)
        impacts = getattr(run, "impacts", None)
        if impacts is not None and not self.lattice:
            times, places = (np.asarray(part, dtype=float) for part in (impacts.t, impacts.x))
            rows = np.searchsorted(self.t, times)
            self.t, self.mu = (np.insert(part, rows, v, 0) for part, v in
                               ((self.t, times), (self.mu, np.nan)))  # fmt: skip
            self.x = np.insert(self.x, rows, places[:, None], 0)
        sites = range(self.x.shape[1])
        self.moving = [k for k in sites if not self.lattice or self.mu[:, k].any()]
        self.controls: Any = getattr(run, "node_controls", None)
        labels = dict(look.labels)
        self.label = labels.get(self.rule, self.rule)

    def column(self, name: str, site: int, k: int) -> Any:
        """Return the values of an entry of "t", "x", "mu" or "control" by row, angles wrapped."""
        import numpy as np

        if name in ("t", "control"):
            return self.t if name == "t" else np.asarray(self.controls, dtype=float)[:, k]
        values = getattr(self, name)[:, site, k]
        return np.pi - (np.pi - values) % (2 * np.pi) if self.wraps(name, k) else values

    def moves(self, name: str, site: int, k: int) -> bool:
        """True if an entry is not the same in all rows, but for round-off beside its like.

        Where all places rest, momenta are round-off beside those that any motion has.
        """
        import numpy as np

        if name == "mu" and self.rests:
            return False
        values = self.column(name, site, k)
        return bool((np.abs(values - values[0]) > ROUNDED * self.size(name)).any())

    @cached_property
    def rests(self) -> bool:
        """True of a scene with momenta of its coordinates, none of which moves."""
        canonical = getattr(getattr(self.subject, "groupoid", None), "canonical", False)
        n = self.x.shape[-1]
        linear = getattr(self.subject, "one_form", None) is not None
        return canonical and not linear and not any(self.moves("x", 0, k) for k in range(n))

    def size(self, name: str) -> float:
        """Return the largest absolute value of all entries of that letter."""
        import numpy as np

        kin = {"t": self.t, "control": self.controls}.get(name, getattr(self, name, None))
        return float(np.nanmax(np.abs(np.asarray(kin, dtype=float)), initial=0))

    def wraps(self, name: str, k: int) -> bool:
        """True if an entry is an angle to be wrapped."""
        return name == "x" and k in self.angles

    def name(self, letter: str, site: int, k: int, alone: bool = False) -> str:
        """Return the words for an entry, such as x₁, or x₁ of site 3 of a lattice."""
        from ..report.wording import subscript

        if letter == "t":
            return "t"
        word = {"mu": "μ"}.get(letter, letter) + ("" if alone else subscript(k + 1))
        return f"{word} of site {site + 1}" if self.lattice and letter != "control" else word


Entry = tuple[str, int, int]  # letter, site, number


def _curves(axes: Axes, runs: Sequence[_Run], across: Entry, ups: Sequence[Entry]) -> None:
    """Draw curves of each run; those of several rules have their looks and names.

    Without several rules the sites of a lattice have a colour each, with a scale beside the axes.
    """
    import numpy as np

    from ..report.alike import shares
    from ..report.labels import end_labels

    colours = {run.label: run.mark.colour for run in runs}
    several, drawn = len(colours) > 1, list[Any]()
    ends = dict[str, tuple[float, float]]()
    tones = None if several or len(ups) < 2 else _tones(axes, len(ups))
    for run, (place, up) in ((run, each) for run in runs for each in enumerate(ups)):
        columns = [run.column(*across), run.column(*up)]
        cuts = _cuts(run, across, up, columns)
        x, y = (np.insert(values, cuts, np.nan) for values in columns)
        colour: Any = tones(place) if tones else run.mark.colour if several else None
        rests = not (run.moves(*across) or run.moves(*up))
        # between impacts momenta may stay: a dot as wide as the line is seen where it has no length
        mark = "o" if rests else "." if np.isnan(columns[0] + columns[1]).any() else ""
        drawn += axes.plot(x, y, lw=0.7, color=colour, marker=mark, ms=6 if rests else 1.5)
        finite = np.flatnonzero(np.isfinite(columns[0] + columns[1]))
        if len(finite):
            ends[run.label] = (columns[0][finite[-1]], columns[1][finite[-1]])
    for axis, (letter, _, k) in ((axes.xaxis, across), (axes.yaxis, ups[0])):
        if runs[0].wraps(letter, k):
            axis.set_ticks([-np.pi, 0, np.pi], labels=["−π", "0", "π"])
    for which, entry in (("x", across), ("y", ups[0])):  # what stays has no scale but its like's
        size = max(0 if entry[0] == "mu" and run.rests else run.size(entry[0]) for run in runs) or 1
        if len(ups) == 1 and not any(run.moves(*entry) for run in runs):
            middle = runs[0].column(*entry)[0]
            getattr(axes, f"set_{which}lim")(middle - size, middle + size)
    if several:
        axes.figure.canvas.draw_idle()
        axes.apply_aspect()
        for k in range(len(ups)):
            own = drawn[k :: len(ups)]
            points = [each.get_xydata()[:: len(each.get_xydata()) // COMPARED + 1] for each in own]
            for line, run, share in zip(own, runs, shares(axes, points), strict=True):
                line.set(**share.line(run.mark, 0.7))
        end_labels(axes, [(*end, label, colours[label]) for label, end in ends.items()])


def _tones(axes: Axes, sites: int) -> Any:
    """Draw the scale of colours by site right of the axes; return the colour of a site from 0."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    # its last tenth is too light on paper
    usual = ListedColormap(colormaps["viridis"](range(230)))
    scale = ScalarMappable(Normalize(1, sites), usual)
    beside = axes.inset_axes((1.04, 0, 0.035, 1))
    bar: Any = axes.figure.colorbar(scale, cax=beside, ticks=sorted({1, (sites + 1) // 2, sites}))
    bar.outline.set_linewidth(0)
    beside.set_title("site", fontsize=8, pad=3)
    beside.tick_params(labelsize=7.5, pad=2)
    return lambda site: scale.to_rgba(site + 1)


def _cuts(run: _Run, across: Entry, up: Entry, columns: Sequence[Any]) -> Any:
    """Return the rows before which a line is broken: where an angle wraps."""
    import numpy as np

    cut = np.zeros(len(run.t), bool)
    for (letter, _, k), values in zip((across, up), columns, strict=True):
        if run.wraps(letter, k):
            cut[1:] |= np.abs(np.diff(values)) > np.pi
    return np.flatnonzero(cut)


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
        settings = matplotlib.rc_params_from_file(str(style), use_default_template=False)
    except (ValueError, OSError) as error:
        raise BadInput(f"{style} is no style file of matplotlib: {error}.") from None
    return Look(tuple(labels.items()), tuple((name, settings[name]) for name in settings))


def _is_file(name: Any) -> bool:
    try:
        return Path(name).is_file()
    except (TypeError, ValueError, OSError):  # no name; a zero byte in it; too long
        return False


def _sheet() -> Any:
    from ..report.canvas import Sheet

    return Sheet(width=3.2, right=0.2)  # as wide as the figures of studies


def _against(
    runs: Sequence[_Run], across: Entry, ups: Sequence[Entry], name: str, path: bool = False
) -> Panel:
    """Return the panel of entries against another; path: both are lengths of one unit."""
    from ..report.canvas import Panel

    def draw(axes: Axes) -> None:
        if path:
            axes.set_aspect("equal", adjustable="datalim")
        _curves(axes, runs, across, ups)

    xlabel = runs[0].name(*across)
    if path and len(ups) > 1:  # of all sites
        xlabel = xlabel.partition(" of ")[0]
    return Panel(_title(runs), name, xlabel, "", draw)


def _title(runs: Sequence[_Run]) -> str:
    """Return the scene's title, with the method if there is one."""
    title = getattr(runs[0].subject, "title", "") or runs[0].subject.name
    labels = dict.fromkeys(run.label for run in runs)
    return f"{title}, by {runs[0].label}" if len(labels) == 1 else title


def _phase(runs: Sequence[_Run]) -> list[Panel]:
    first = runs[0]
    n, m = first.x.shape[-1], first.mu.shape[-1]
    if getattr(first.subject, "one_form", None) is not None and n > 1:  # μ = ϑ(x): x is the phase
        pairs = [("x", i, "x", i + 1) for i in range(0, n - 1, 2 if n % 2 == 0 else 1)]
    elif n == m:
        pairs = [("x", i, "mu", i) for i in range(m)]
    elif m > 1:
        pairs = [("mu", i, "mu", (i + 1) % m) for i in range(m if m > 2 else 1)]
    else:
        raise BadInput("x and μ have no entries in pairs here: there is no phase portrait.")
    planes = [((a, site, i), (b, site, j)) for site in first.moving for a, i, b, j in pairs]
    # where nothing moves, as out of the plane of an orbit, there is no curve
    moving = [pair for pair in planes if any(run.moves(*entry) for run in runs for entry in pair)]
    return [_against(runs, a, [b], first.name(*b)) for a, b in moving or planes]


def _base(runs: Sequence[_Run]) -> list[Panel]:
    if not (pairs := pairs_of_path(runs[0].subject, runs[0].x.shape[-1])):
        return _time(runs)
    return [_against(runs, ("x", 0, i), [("x", 0, j)], runs[0].name("x", 0, j), path=True)
            for i, j in pairs]  # fmt: skip


def is_base_another(run: Any) -> bool:
    """True if the figure "base" of a run is that of "time", or with a one-form that of "phase"."""
    subject, _ = subject_of(run) or (None, None)
    n = run.x.shape[-1]
    return not pairs_of_path(subject, n) or (n == 2 and getattr(subject, "one_form", 0) is not None)


def pairs_of_path(subject: Any, n: int) -> list[tuple[int, int]]:
    """Return the pairs of the n entries of x that show its path; [] without one: then it is drawn
    against time.

    With four or more coordinates no pair is the path, but that of a place among them.
    """
    if not hasattr(subject, "groupoid"):  # a lattice
        return []
    place = [int(k) for k in frame_of(subject.groupoid, n)[0]]
    return [*combinations(place or range(n if n < 4 else 0), 2)]


def frame_of(groupoid: Any, n: int) -> tuple[Any, Any]:
    """Return the entries of x that are a body's place, and those of its attitude's rows.

    They are arrays (d,) and (d, d) of indices, d = 2 or 3, where x is a rotation, a rotation and a
    place in one matrix, or a place beside a rotation. The place of a rotation alone is empty, and
    so are both of any other x.
    """
    import numpy as np

    nowhere, parts = np.arange(0), [*getattr(groupoid, "parts", ())]
    if len(parts) == 2 and parts[0].canonical:
        d = parts[0].dim_x
        place, attitude = frame_of(parts[1], n - d)
        if len(attitude) == d and not len(place):
            return np.arange(d), attitude + d
    size = groupoid.algebra.size if getattr(groupoid, "rows", 1) > 1 else 0
    if size and n == size**2:
        basis: Any = np.array(
            [[[complex(e) for e in row] for row in m] for m in groupoid.algebra.basis]
        )
        d = size if basis[:, -1].any() else size - 1
        turns, entries = basis[:, :d, :d], np.arange(n).reshape(size, size)[:d]
        if d in (2, 3) and not (turns + turns.swapaxes(1, 2)).any():
            return entries[:, d:].ravel(), entries[:, :d]
    return nowhere, nowhere


def _time(runs: Sequence[_Run]) -> list[Panel]:
    """Return a panel for each coordinate that moves, or for all if none does.

    Those of a body's place come first, and its last row of attitude, which the others tell, goes.
    """
    first = runs[0]
    sites, n = first.x.shape[1:]
    if not n:
        raise BadInput("there is no base here: on a group x is empty, and momenta are its phase.")
    moving = [k for k in range(n)
              if any(run.moves("x", site, k) for run in runs for site in range(sites))]  # fmt: skip
    words = " of each site" if first.lattice else ""
    groupoid = getattr(first.subject, "groupoid", None)
    if len(place := () if groupoid is None else frame_of(groupoid, n)[0]):
        moving = sorted(moving, key=lambda k: k not in place)[:MOST_PANELS]

    def name(k: int) -> str:
        return first.name("x", 0, k, alone=first.lattice and n == 1).partition(" of ")[0] + words

    return [_against(runs, ("t", 0, 0), [("x", site, k) for site in range(sites)], name(k))
            for k in moving or range(n)]  # fmt: skip


def _control(runs: Sequence[_Run]) -> list[Panel]:
    if any(run.controls is None for run in runs):
        raise BadInput('kind "control" is of a motion that control.solve(...) returns.')
    count = range(runs[0].controls.shape[1])
    acting = [
        k for k in count  # one that is steady acts, and one that is round-off does not
        if any(abs(e[:, k]).max() > ROUNDED * abs(e).max() for e in (run.controls for run in runs))
    ]  # fmt: skip
    return [_against(runs, ("t", 0, 0), [("control", 0, k)], runs[0].name("control", 0, k))
            for k in acting or count]  # fmt: skip


def _energy(runs: Sequence[_Run]) -> list[Panel]:
    import numpy as np

    from ..core.case import Case
    from ..systems import system_of
    from ..systems.runs import energy_errors, energy_with_terms

    label = "relative energy error"
    for run in runs:
        if run.controls is not None:
            raise BadInput("controls change the energy: it has no error to draw.")
        if run.lattice:
            system = system_of(Case("plot", run.subject, run.run.scheme.rule, 16))
            errors = system.energy_errors(run.run)
        elif run.subject.contact is not None or run.subject.force is not None:
            # over its terms at the start: the motion without obstacle or force has other energies
            values, terms = energy_with_terms(run.run.scheme, 16)(run.run)
            errors = (values - values[0])[:, 0] / (float(terms[0].max()) or 1.0)
            label = "relative change of the energy"
        else:
            errors = energy_errors(run.run.scheme, run.run, 16)
        run.t, run.x = np.asarray(run.run.t, dtype=float), errors.reshape(-1, 1, 1)
        run.angles, run.moving = (), [0]
    return [_against(runs, ("t", 0, 0), [("x", 0, 0)], label)]
