"""`plot`, labels and styles of figures, and what a notebook shows of a result."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

from discmech import (
    BadInput,
    Lattice,
    Scheme,
    check,
    film,
    midpoint,
    pair,
    plot,
    scenes,
    trapezoidal,
)
from discmech.studies.command.entry import main


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


@pytest.mark.parametrize(("scene", "kind", "panels"), [
    ("pendulum", "phase", 1), ("kepler", None, 2), ("kepler", "base", 1), ("kepler", "energy", 1),
    ("rigid-body", "phase", 3), ("heavy-top", "base", 3), ("pendulum", "base", 1),
])  # fmt: skip
def test_a_run_is_a_figure(scene, kind, panels):
    figure = plot(run_of(scene), kind)
    assert len(figure.axes) == panels
    assert all(len(axes.lines[0].get_xdata()) == 201 for axes in figure.axes)


def test_a_label_that_was_asked_for_is_shown_beside_one_run_too():
    assert "Gauss" in words(plot(run_of("kepler"), labels={"midpoint": "Gauss"}))
    assert "midpoint" not in words(plot(run_of("kepler")))


def test_the_energy_drawn_is_that_of_the_run():
    figure = plot([run_of("pendulum"), run_of("pendulum", trapezoidal)], "energy")
    (axes,) = figure.axes
    assert "midpoint" in words(figure) and "trapezoidal" in words(figure)
    assert len({line.get_color() for line in axes.lines}) == 2
    for line in axes.lines:
        assert 1e-6 < max(abs(line.get_ydata())) < 1e-2 and line.get_ydata()[0] == 0


def test_contact_runs_are_drawn():
    assert plot(run_of("bouncing-ball"), "base").axes


@pytest.mark.parametrize(("thing", "kind", "words"), [
    (3, None, "plot takes what check"), ([], None, "plot takes what check"),
    ("pendulum", "phas", "phase"), ("rigid-body", "base", "no base here"),
    ("charged-particle", "energie", "energy"),
])  # fmt: skip
def test_what_cannot_be_drawn_is_said(thing, kind, words):
    run = run_of(thing) if isinstance(thing, str) else thing
    with pytest.raises(BadInput, match=words):
        plot(run, kind)


def test_a_lattice_is_no_phase_portrait():
    chain = Lattice(
        name="c", site=pair(1), sites=3, on_site=lambda x, v, p: v[0] ** 2 / 2,
        on_bond=lambda x, y, p: -((y[0] - x[0]) ** 2) / 2, x0=[[0], [1], [0]], v0=[[0]] * 3,
    )  # fmt: skip
    with pytest.raises(BadInput):
        plot(Scheme(chain, midpoint).flow("0.1").trajectory(5))


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
])  # fmt: skip
def test_bodies_move_in_a_film(name, bodies, size, lines):
    scene = scenes.get(name)
    scene = scene.with_attitude() if name == "rigid-body" else scene
    run = Scheme(scene, midpoint).flow(scene.step).trajectory(200)
    shown = film(run, bodies)
    (axes,) = shown._fig.axes
    assert shown._func(7) and len(axes.lines) == lines
    assert hasattr(axes, "get_zlim") is (size == 3)
    shown._draw_was_started = True  # nothing is to be shown


@pytest.mark.parametrize(("name", "bodies", "words"), [
    ("double-pendulum", lambda x: x, "points, each of 2 or 3"),
    ("rigid-body", None, "need not be a place"),
    ("pendulum", None, "say where its bodies are"), (None, None, "film takes a trajectory"),
    ("pendulum", lambda x: [[0, 0], [x[0] / 0, 1]], "not finite"),
    ("pendulum", lambda x: x["joint"], "bodies.x. raises IndexError"),
    ("pendulum", "joint", "give a function of x"),
])  # fmt: skip
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_what_is_no_film_is_said(name, bodies, words):
    with pytest.raises(BadInput, match=words):
        film(run_of(name) if name else 3, bodies)
    with pytest.raises(BadInput, match="seconds is -1"):
        film(run_of("kepler"), seconds=-1)
