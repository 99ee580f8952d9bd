"""`plot`, labels and styles of figures, and what a notebook shows of a result."""

import importlib
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from discmech import (
    BadInput,
    Scene,
    Scheme,
    check,
    film,
    lie_group,
    midpoint,
    pair,
    plot,
    scenes,
    se,
    trapezoidal,
)
from discmech.integrators import rules
from discmech.integrators.extensions.control import scenes as problems
from discmech.studies.command.entry import main
from discmech.studies.core.result import result_of
from discmech.studies.report.palette import Mark
from discmech.studies.report.plot_convergence import Line, Point
from discmech.studies.report.plot_convergence import panel as convergence
from discmech.studies.symplecticity.plot import _limits
from discmech.studies.user.drawing import MOST_PANELS, is_base_another
from discmech.studies.user.filming import _columns


@pytest.fixture(scope="module")
def result():
    return check("order", ["pendulum"], ["midpoint", "trapezoidal"], [16], steps=100)


def run_of(name, rule=midpoint):
    scene = scenes.get(name)
    return Scheme(scene, rule).flow(scene.step).trajectory(200)


def words(figure):
    from matplotlib.text import Text

    return " ".join(text.get_text() for text in figure.findobj(Text))


def test_a_result_is_a_figure_that_can_be_changed(result, tmp_path):
    figure = plot(result, labels={"trapezoidal": "Störmer–Verlet"})
    assert isinstance(figure, Figure) and "Störmer–Verlet  2.00" in words(figure)
    assert figure._repr_png_().startswith(b"\x89PNG")  # in a notebook without pyplot
    with pytest.raises(BadInput, match='no rule "midpont": did you mean midpoint'):
        plot(result, labels={"midpont": "m"})
    figure.axes[0].set_title("mine")
    figure.savefig(tmp_path / "mine.pdf")
    assert (tmp_path / "mine.pdf").stat().st_size > 1000


@pytest.mark.parametrize(("asked", "columns"), [(3.4, 1), (7, 2), (1, 1)])
def test_a_figure_is_as_wide_as_a_column(result, tmp_path, asked, columns):
    """Panels stand below one another, words keep their size; a figure that cannot is wider."""
    (tmp_path / "p.mplstyle").write_text(f"figure.figsize: {asked}, 2\n", "utf-8")
    twice = {**result, "cases": [*result["cases"], *({**c, "scene": "b"} for c in result["cases"])]}
    figure = plot(twice, style=tmp_path / "p.mplstyle")
    wide = figure.get_size_inches()[0]
    assert wide == pytest.approx(asked, abs=0.02) or wide > asked == 1
    assert len({axes.get_position().x0 for axes in figure.axes}) == columns
    long = "words in lines, as many as are too long for a column of a journal"
    scene = [{**case, "scene": long} for case in result["cases"]]
    figure = plot(
        {**result, "cases": scene}, labels={"midpoint": long}, style=tmp_path / "p.mplstyle"
    )
    figure.canvas.draw()
    ends = [text.get_window_extent().x1 for text in figure.axes[0].texts]
    assert max(ends) <= figure.bbox.x1 and (
        asked == 1 or figure.get_size_inches()[0] <= asked + 0.02
    )


@pytest.mark.parametrize(("scene", "kind", "panels"), [
    ("pendulum", "phase", 1), ("kepler", None, 2), ("kepler", "base", 1), ("kepler", "energy", 1),
    ("rigid-body", "phase", 3), ("heavy-top", "base", 3), ("pendulum", "base", 1),
    ("kepler", "time", 2), ("heavy-top", "time", 3), ("pendulum", "time", 1),
])  # fmt: skip
def test_a_run_is_a_figure(scene, kind, panels):
    figure = plot(run_of(scene), kind)
    assert len(figure.axes) == panels
    assert all(len(axes.lines[0].get_xdata()) == 201 for axes in figure.axes)


def test_the_title_of_one_run_has_the_method_by_its_label():
    assert "by Gauss" in words(plot(run_of("kepler"), labels={"midpoint": "Gauss"}))
    assert words(plot(run_of("kepler"))).count("e = 0.6, by midpoint") == 1  # of two panels


def test_names_of_several_runs_stand_beside_the_axes():
    figure = plot([run_of("kepler"), run_of("kepler", trapezoidal)])
    for axes in figure.axes:
        names = [text for text in axes.texts if text.get_text() in ("midpoint", "trapezoidal")]
        assert len(names) == 2 and axes.get_legend() is None
        assert all(text.get_window_extent().x0 >= axes.bbox.x1 for text in names)


def test_rules_of_one_name_have_that_of_their_files(tmp_path, monkeypatch):
    """Several students' functions are called step; two of one file are numbered."""
    text = """from discmech import black_box
def made(c):
    @black_box(order=1)
    def step(q, p, h, system):
        p = p - c * h * system.gradient(q, p)
        return q + h * system.velocity(q, p), p
    return step
step, other = made(1), made(1.1)
"""
    monkeypatch.syspath_prepend(tmp_path)
    rules = []
    for name in ("anna_b", "ben_b"):
        (tmp_path / f"{name}.py").write_text(text)
        module = importlib.import_module(name)
        rules += [module.step, module.other]
    runs = [run_of("pendulum", rule) for rule in (*rules[:1], *rules[2:])]
    wanted = ["anna_b-step", "ben_b-step (1)", "ben_b-step (2)"]
    (axes,) = plot(runs, "energy", labels={"anna_b-step": "Anna"}).axes
    assert {text.get_text() for text in axes.texts} >= {"Anna", *wanted[1:]}
    assert "by anna_b-step" not in words(plot(runs[:1])) and "by step" in words(plot(runs[:1]))
    result = check("energy", ["pendulum"], [rules[0], *rules[2:], "midpoint"], steps=200)
    assert [case["rule"] for case in result["cases"]] == [*wanted, "midpoint"]
    assert "ben_b-step (1)" in words(plot(result, labels={"anna_b-step": "Anna"}))


def test_a_coordinate_that_stays_has_no_panel():
    """And coordinates against time say t below; a state that rests altogether is a point."""
    still = scenes.get("charged-particle").with_values(v0=[0, 0, 1], x0=[0, 0, 0])
    run = Scheme(still, midpoint).flow("0.1").trajectory(50)
    assert len(plot(run).axes) == 1
    rest = scenes.get("pendulum").with_values(x0=[0])
    still = Scheme(rest, midpoint).flow("0.1").trajectory(5)
    marks = [plot(still, kind).axes[0].lines[0].get_marker() for kind in ("phase", "time")]
    assert marks == ["o", ""]  # against time it would be a band, as a fixed end of a lattice
    hung = Scene("hung", pair(1), lambda x, v, p: v[0] ** 2 / 2 - p.k * x[0] ** 2 / 2 + 10 * x[0],
                 parameters={"k": "3.1"}, x0=["3.22580645161290322"], v0=[0])  # fmt: skip
    still = Scheme(hung, midpoint).flow("0.01").trajectory(200)
    (rounded,) = plot(still).axes
    assert abs(still.mu).max() > 0 and rounded.lines[0].get_marker() == "o"
    assert rounded.get_ylim() == (-1, 1)
    (axes,) = plot(run, "time").axes
    assert not empty(axes) and axes.get_xlabel() == "t" and "x₃" in words(axes.figure)


def test_lines_of_all_precisions_are_as_far_apart():
    asked = check("symplecticity", ["harmonic"], ["midpoint", "trapezoidal"], [16, 50])
    first, second = plot({**asked, "cases": asked["cases"][:-1]}).axes
    assert first.get_ylim() == second.get_ylim() and "trapezoidal" in words(first)
    assert "trapezoidal" not in words(second)


def test_the_slope_is_drawn_beside_the_fit():
    fit = [Point(h, h**2, used=True) for h in (1, 0.5, 0.25, 0.125)]
    floor = [Point(10.0**-k, 10.0 ** (k - 4), why_not="round-off") for k in (2, 3, 4, 5)]
    case = result_of("order", {"rule": "midpoint", "verdict": "pass"})
    axes = Figure().subplots()
    convergence("", [Line(case, [*floor, *fit], 2.0, 2.0)], {"midpoint": Mark("k", "o")}).draw(axes)
    (triangle,) = (line for line in axes.lines if line.get_transform() == axes.transAxes)
    assert min(triangle.get_xdata()) > 0.6


def test_the_place_of_a_body_in_space_comes_first():
    body = Scene("falls", lie_group(se(3)), lambda x, v, p: v.dot(v) / 2 - x[11], duration=1,
                 v0=[1, 2, 3, 1, 1, 0]).with_attitude()  # fmt: skip
    run = Scheme(body, midpoint).flow("0.1").trajectory(10)
    names = re.findall("x[₀-₉]+", words(plot(run, "time")))
    assert names[:3] == ["x₄", "x₈", "x₁₂"] and len(names) == MOST_PANELS


def test_runs_that_coincide_are_both_seen():
    """Störmer–Verlet and the trapezoidal rule: one motion, so one of the lines has gaps."""
    runs = [run_of("pendulum", rules.get(name)) for name in ("trapezoidal", "lobatto-2")]
    (axes,) = plot(runs).axes
    under, over = axes.lines
    assert not under.is_dashed() and over.is_dashed() and under.get_color() != over.get_color()
    (apart,) = plot([runs[0], run_of("pendulum", rules.get("rectangle"))], "energy").axes
    assert not any(line.is_dashed() for line in apart.lines)


def test_an_axis_of_defects_ends_before_a_limit_far_above_them():
    """Between 10⁻⁴⁴ and a limit of 10⁻¹³ there is nothing to see; one near round-off is shown."""
    figure = plot(check("symplecticity", ["harmonic"], ["midpoint"], [16]))
    assert figure.axes[0].get_xlim()[1] < 1e-30 and "limit 10⁻¹³ →" in words(figure)
    for defects in ([1e-17, 1e-15], [0.1], [1e-44, 1e-20], []):
        low, high = _limits(defects, [1e-16, 3e-13])
        assert low < min([*defects, 1e-16]) and high > max([*defects, 3e-13])


@pytest.mark.slow
def test_the_sites_of_a_lattice_have_colours_and_a_scale(cradle):
    (axes,) = plot(cradle, "time").axes
    assert len({line.get_color() for line in axes.lines}) == len(axes.lines) == 6
    (scale,) = axes.child_axes
    assert scale.get_title() == "site" and list(scale.get_yticks()) == [1, 3, 6]


def empty(axes):
    """True if all curves of a panel are flat."""
    curves = [line.get_data() for line in axes.lines]
    return all(np.nanmax(part) == np.nanmin(part) for curve in curves for part in curve[1:])


def test_a_run_with_a_one_form_is_drawn_in_its_phase_space():
    """μ = ϑ(x), here (0, …): a panel of x₂ against its μ would be flat."""
    scene = scenes.get("lotka-volterra-half")
    run = Scheme(scene, rules.get("degenerate-gauss-1")).flow(scene.step).trajectory(50)
    (axes,) = plot(run).axes
    assert axes.get_xlabel() == "x₁" and "x₂" in words(axes.figure) and not empty(axes)
    assert is_base_another(run) and not is_base_another(run_of("kepler"))


@pytest.mark.dear("6]")
@pytest.mark.parametrize(("kind", "panels"), [(None, 6), ("base", 1), ("energy", 1)])
def test_a_lattice_with_contact_is_drawn(cradle, kind, panels):
    figure = plot(cradle, kind)
    assert len(figure.axes) == panels and not any(map(empty, figure.axes))
    assert len(figure.axes[0].lines) == (6 if kind == "base" else 1)
    assert ("site 6" in words(figure)) is (kind is None)


def test_runs_of_other_sizes_are_not_drawn_together(cradle):
    for other in (run_of("kepler"), cradle):
        with pytest.raises(BadInput, match="cannot be drawn together"):
            plot([run_of("pendulum"), other])


@pytest.mark.slow
def test_fixed_sites_have_no_panel_and_many_have_nine():
    lattice = scenes.lattices.get("fput")
    run = Scheme(lattice, trapezoidal).flow(lattice.step).trajectory(50)
    figure = plot(run)
    assert len(figure.axes) == MOST_PANELS and not any(map(empty, figure.axes))


@pytest.fixture(scope="module")
def cradle():
    return Scheme(scenes.lattices.get("cradle"), trapezoidal).flow("0.01").trajectory(300)


@pytest.fixture(scope="module")
def steered():
    return problems.get("double-integrator").solve(20, midpoint)


def test_a_steered_motion_is_drawn_and_filmed(steered):
    (axes,) = plot(steered).axes
    assert list(axes.lines[0].get_ydata()) == list(steered.node_controls[:, 0])
    assert "by midpoint" in words(axes.figure) and len(plot(steered, "base").axes) == 1
    with pytest.raises(BadInput, match="controls change the energy"):
        plot(steered, "energy")
    top = problems.get("upright-top").solve(8)  # its third torque is round-off
    assert len(plot(top).axes) == 2 and len(plot(top, "time").axes) == 3
    still = plot(top, "phase").axes[2]  # μ₃, which is round-off: it is no curve
    assert np.ptp(still.lines[0].get_ydata()) < 1e-9 < 0.1 < np.ptp(still.get_ylim())
    with pytest.raises(BadInput, match='kind "control" is of a motion'):
        plot(run_of("pendulum"), "control")
    drawn(film(steered, lambda x: [[x[0], 0]]), 7)


def test_angles_are_wrapped_on_request():
    """Where they jump the line is broken; a pendulum that turns leaves the picture else."""
    scene = scenes.get("pendulum").with_values(v0=[3])
    run = Scheme(scene, midpoint).flow("0.1").trajectory(100)
    assert np.abs(run.x).max() > 2 * np.pi
    for wrap in ([0], True):
        (axes,) = plot(run, wrap=wrap).axes
        angles = axes.lines[0].get_xdata()
        assert np.nanmax(np.abs(angles)) <= np.pi
        assert np.nanmax(np.abs(np.diff(angles))) < np.pi and np.isnan(angles).sum() > 1
        assert [tick.get_text() for tick in axes.get_xticklabels()] == ["−π", "0", "π"]
    with pytest.raises(BadInput, match="name the entries of x that are angles"):
        plot(run, wrap=[1])


def test_a_power_of_ten_is_written_beside_the_axis_s_name():
    """matplotlib would write it over the subtitle."""
    figure = plot(run_of("kepler"), "energy")
    (axes,) = figure.axes
    assert not axes.yaxis.get_offset_text().get_visible()
    assert "relative energy error, in 10⁻⁴" in words(figure)
    assert all(abs(tick) < 1e-2 for tick in axes.get_yticks())
    labels = [text.get_text().replace("−", "-") for text in axes.get_yticklabels()]
    assert max(abs(float(label)) for label in labels) >= 1


def test_the_energy_drawn_is_that_of_the_run():
    figure = plot([run_of("pendulum"), run_of("pendulum", trapezoidal)], "energy")
    (axes,) = figure.axes
    assert "midpoint" in words(figure) and "trapezoidal" in words(figure)
    assert len({line.get_color() for line in axes.lines}) == 2
    for line in axes.lines:
        assert 1e-6 < max(abs(line.get_ydata())) < 1e-2 and line.get_ydata()[0] == 0


def test_a_contact_run_is_drawn_through_its_impacts():
    """Between the rows before and after it a ball would turn in the air."""
    run = run_of("bouncing-ball")
    assert run.x.min() > 1e-4 and len(run.impacts.t) == 4
    for kind, breaks in (("base", 0), ("phase", 4)):  # momenta jump
        (axes,) = plot(run, kind).axes
        across, up = axes.lines[0].get_data()
        heights = up if kind == "base" else across
        assert len(up) == 205 and heights.min() < 1e-15 and np.isnan(up).sum() == breaks
        assert axes.lines[0].get_marker() == "." * bool(breaks)  # a piece may have no length


def test_the_energy_lost_in_impacts_is_drawn_over_that_of_the_start():
    """Not over that of the fall without a floor: a ball that comes to rest has lost all."""
    ball = scenes.get("bouncing-ball").with_values(restitution="0.5")
    (axes,) = plot(Scheme(ball, midpoint).flow("0.05").trajectory(160), "energy").axes
    assert axes.lines[0].get_ydata()[-1] == pytest.approx(-1, abs=1e-3)


def test_runs_that_end_at_unlike_times_say_so_beside_their_names():
    result = check("order", "kepler", rules=["rectangle", "midpoint"], digits=16)
    words = [text.get_text() for text in plot(result).axes[0].texts]
    assert [w for w in words if "rectangle" in w and "at t = 1.184" in w]
    assert [w for w in words if "midpoint" in w and "at t = 5" in w]


@pytest.mark.parametrize(("thing", "kind", "words"), [
    (3, None, "plot takes what check"), ([], None, "plot takes what check"),
    ("pendulum", "phas", "phase"), ("rigid-body", "base", "no base here"),
    ("charged-particle", "energie", "energy"),
])  # fmt: skip
def test_what_cannot_be_drawn_is_said(thing, kind, words):
    run = run_of(thing) if isinstance(thing, str) else thing
    with pytest.raises(BadInput, match=words):
        plot(run, kind)


def test_the_command_takes_labels_and_a_style(tmp_path, capsys):
    style = tmp_path / "mine.mplstyle"
    style.write_text("font.family: DejaVu Sans\nlines.linewidth: 3\n", "utf-8")
    asked = ["order", "pendulum", "--rule", "midpoint", "--digits", "16", "--steps", "100"]
    look = [
        "--label",
        "midpoint=Mittelpunkt",
        "--style",
        str(style),
        "--folder",
        str(tmp_path / "f"),
    ]
    assert main([*asked, *look]) == 0
    svg = (tmp_path / "f" / "figures" / "order-16.svg").read_text("utf-8")
    assert "Mittelpunkt" in svg and "DejaVu Sans" in svg
    # each word says its width, so that none is cut at an edge where a reader has other fonts
    words = re.findall(r'start;[^>]* x="([\d.]+)"[^>]*textLength="([\d.]+)"', svg)
    ends = [float(x) + float(width) for x, width in words]
    edge = float(re.findall(r'width="([\d.]+)pt"', svg)[0])
    assert ends and max(ends) <= edge and svg.count("<text") == svg.count("textLength")
    assert "Mittelpunkt & 1.9" in (tmp_path / "f" / "tables" / "order-paper.tex").read_text("utf-8")
    assert main([*asked, "--label", "midpoint"]) == 2
    assert main([*asked, "--style", str(tmp_path / "none")]) == 2
    style.write_bytes(b"\xff\xfe\x00")
    assert main([*asked, "--style", str(style)]) == 2
    said = capsys.readouterr().err
    assert "--label midpoint=" in said and "no style file" in said


def test_a_notebook_shows_the_table_the_reason_and_the_figure(result):
    html = result._repr_html_()
    assert "<table>" in html and html.count("<svg") == 1 and ">pass<" in html
    failed = {
        **result["cases"][0],
        "verdict": "fail",
        "reason": "a < b",
        "command": "discmech order",
    }
    shown = type(result)({**result, "cases": [failed]})._repr_html_()
    assert "a &lt; b" in shown and "discmech order" in shown


@pytest.mark.parametrize(("name", "bodies", "size", "lines"), [
    ("kepler", None, 2, 1), ("pendulum", lambda x: [[0, 0], [x[0], 1]], 2, 1),
    ("heavy-top", None, 3, 1),
    ("kepler", lambda x: [[[0, 0], x], [[1, 1], [2, 2], x]], 2, 2), ("rigid-body", None, 3, 3),
    ("pivoted-body", None, 3, 3), ("chaplygin-sleigh", None, 2, 2), ("kirchhoff", None, 3, 3),
])  # fmt: skip
def test_bodies_move_in_a_film(name, bodies, size, lines):
    scene = scenes.get(name)
    scene = scene if len(scene.x0) else scene.with_attitude()
    run = Scheme(scene, midpoint).flow(scene.step).trajectory(200)
    shown = film(run, bodies)
    (axes,) = shown._fig.axes
    drawn(shown, 7)
    assert len(axes.lines) == 2 * lines  # each with a trail
    assert hasattr(axes, "get_zlim") is (size == 3)
    row, trail = axes.lines[0], axes.lines[lines]
    # by a row of the run each, and not by the frames alone, which are fewer
    assert len(trail.get_xdata()) == 1 + np.linspace(0, 200, 120).astype(int)[7]
    assert trail.get_xdata()[-1] == row.get_xdata()[-1]
    assert f"{scene.title}, by midpoint" in axes.get_title("left")


def test_the_axes_of_a_body_in_the_plane_are_at_its_place():
    """x is a matrix (A, place; 0, 1) row by row, of the size of an attitude in space."""
    scene = scenes.get("chaplygin-sleigh").with_attitude()
    run = Scheme(scene, midpoint).flow(scene.step).trajectory(100)
    lines = drawn(film(run), 100).lines
    long = np.ptp(run.x[:, [2, 5]], axis=0).max() / 8
    for k, line in enumerate(lines[:2]):
        tip, place = line.get_xydata()
        assert place == pytest.approx(run.x[-1, [2, 5]])
        assert (tip - place) / long == pytest.approx(run.x[-1, [k, 3 + k]])
        assert lines[2 + k].get_xydata()[-1] == pytest.approx(place)  # its trail
    (axes,) = plot(run, "base").axes
    assert (axes.lines[0].get_xydata() == run.x[:, [2, 5]]).all()
    with pytest.raises(BadInput, match="need not be a place"):  # no rotations of space
        film(Scheme(scenes.get("rigid-body-so4").with_attitude(), midpoint).flow(0.1).trajectory(2))


def drawn(shown, frame):
    """Draw a frame of a film."""
    assert shown._func(frame)
    shown._draw_was_started = True  # nothing is to be shown
    return shown._fig.axes[0]


def test_each_mass_is_a_body_of_its_own():
    axes = drawn(film(run_of("pleiades"), trail=False), 3)
    assert [len(line.get_xdata()) for line in axes.lines] == [1] * 7
    assert len({line.get_color() for line in axes.lines}) == 7
    apart = drawn(film(run_of("pendulum"), lambda x: [[[k, x[0]]] for k in range(20)]), 1).lines
    assert len({(line.get_color(), line.get_marker()) for line in apart}) == 20


@pytest.mark.slow
def test_a_lattice_is_filmed(cradle):
    """Side by side at the heights x, or as balls on a line: x is then a number a site."""
    (line,) = drawn(film(cradle), 5).lines
    assert list(line.get_xdata()) == [*range(6)]
    balls = drawn(film(cradle, lambda x: [[(k + x[k], 0)] for k in range(len(x))]), 5)
    assert len(balls.lines) == 6
    membrane = scenes.lattices.get("membrane")
    net = Scheme(membrane, trapezoidal).flow(membrane.step).trajectory(2)
    lines = drawn(film(net), 1).lines  # its rows, then its columns
    assert [len(line.get_xdata()) for line in lines] == 32 * [16]
    assert set(lines[1].get_data_3d()[1]) == {1} and set(lines[17].get_data_3d()[0]) == {1}
    bonds = {(0, 1), (2, 3), (0, 2), (1, 3)}
    assert (_columns(bonds, 4), _columns(bonds | {(0, 3)}, 4), _columns({(0, 1)}, 3)) == (2, 0, 0)


@pytest.mark.parametrize(("name", "bodies", "words"), [
    ("double-pendulum", lambda x: x, "points, each of 2 or 3"),
    ("rigid-body", None, "a run of scene.with_attitude"),
    ("double-pendulum", None, "need not be a place"),
    ("pendulum", None, "say where its bodies are"), (None, None, "film takes a trajectory"),
    ("pendulum", lambda x: [[0, 0], [x[0] / 0, 1]], "not finite"),
    ("pendulum", lambda x: x["joint"], "bodies.x. raises IndexError"),
    ("pendulum", lambda q, p: [[q, p]], r"TypeError.* array of shape \(1,\) here: return a list"),
    ("pendulum", lambda x: x, r"returns array.* such lists, as lambda x: \[\[0, 0\], \[np.sin"),
    ("pendulum", lambda x: [["a", 0]], "returns .*'a', 0"),
    ("kepler", lambda x: [[x]] * (1 + (x[0] > 0)), "now more and now fewer"),
    ("pendulum", "joint", "give a function of x"),
])  # fmt: skip
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_what_is_no_film_is_said(name, bodies, words):
    with pytest.raises(BadInput, match=words):
        film(run_of(name) if name else 3, bodies)
    with pytest.raises(BadInput, match="seconds is -1"):
        film(run_of("kepler"), seconds=-1)


@pytest.mark.dear("solar")
@pytest.mark.parametrize(("scene", "bodies", "names"), [
    ("kepler", None, ["x₁", "x₂"]), ("heavy-top", None, ["x₁", "x₂", "x₃"]),
    ("outer-solar-system", None, ["x", "y", "z"]), ("pendulum", lambda x: [[x[0], 0]], ["x", "y"]),
])  # fmt: skip
def test_a_film_names_its_axes(scene, bodies, names):
    axes = drawn(film(run_of(scene), bodies), 3)
    assert [getattr(axes, f"get_{k}label")() for k in "xyz"[: len(names)]] == names


def test_a_chain_fills_its_film():
    """Its displacements have another unit than the numbers of its sites."""
    lattice = scenes.lattices.get("fput")
    run = Scheme(lattice, trapezoidal).flow(lattice.step).trajectory(50)
    axes = drawn(film(run), 0)
    assert [axes.get_xlabel(), axes.get_ylabel()] == ["site", "x"]
    low, high = axes.get_ylim()
    assert high - low < 2 * np.ptp(run.x)
