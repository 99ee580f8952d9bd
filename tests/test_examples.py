"""Every example runs, and shows what it says."""

import ast
import importlib.util
import json
import math
import re
from pathlib import Path

import pytest
import sympy
from sympy import Rational

from discmech import check
from discmech.integrators import BadInput, Scheme, midpoint, scenes, trapezoidal
from discmech.integrators.numbers import evaluate_matrix
from discmech.integrators.retractions import Retraction
from discmech.integrators.rules import gauss
from discmech.studies.work_precision.peers import rebounds

FOLDER = Path(__file__).resolve().parent.parent / "examples"


def example(name):
    spec = importlib.util.spec_from_file_location(f"example_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def orders(result):
    return {(c["scene"], c["rule"]): c["measured"]["order"] for c in result["cases"]}


@pytest.mark.slow
def test_toda_solitons():
    """Where all crossings should leave them, to the order of each rule; tr Lᵐ whatever N is."""
    toda = example("toda_solitons")
    for rule, order, count in ((trapezoidal, 2, 30), (gauss(2), 4, 10)):
        off = [toda.crossed(count, rule, step) for step in (0.1, 0.05)]
        assert math.log2(off[0] / off[1]) == pytest.approx(order, abs=0.1)
    drifts = [toda.integrals(sites, trapezoidal, 0.1, 2000)[1:].max() for sites in (32, 512)]
    assert max(drifts) < 0.01 and 1 / 4 < drifts[0] / drifts[1] < 4
    assert toda.integrals(32, trapezoidal, 0.05, 4000)[1:].max() < drifts[0] / 2


@pytest.mark.slow
def test_flying_spaghetti():
    """A drift that made the band would have the middles of first and last fifth 4/5 of it apart."""
    found = example("flying_spaghetti").main(500, 50_000)
    assert found["momentum"] < 1 and found["angular momentum"] < 1 and found["rolled"] > 2 * math.pi
    lows, highs = zip(*found["bands"], strict=True)
    middles = [(low + high) / 2 for low, high in found["bands"]]
    assert max(highs) - min(lows) < 1e-5
    assert abs(middles[-1] - middles[0]) < 0.5 * (max(highs) - min(lows))


@pytest.mark.slow
def test_three_bodies():
    """Known as bodies; at rest they have no momentum, and the centre of mass stays at 0."""
    scene = example("three_bodies").pythagorean
    assert rebounds.bodies(scene) == rebounds.Bodies((5.0, 4.0, 3.0), 1.0, 2)
    run = Scheme(scene, gauss(8)).flow("1/2000").trajectory(2000, every=100)
    centre = run.x.reshape(-1, 3, 2).transpose(0, 2, 1) @ [5, 4, 3]
    assert abs(centre).max() < 1e-13 and abs(run.x[-1] - run.x[0]).max() > 0.1


@pytest.mark.slow
def test_exact_series():
    found = example("exact_series").main()
    assert found["verdict"] == "pass"
    assert list(orders(found).values()) == pytest.approx([8], abs=0.001)
    for name in ("pendulum", "heavy-top", "kirchhoff"):  # what it is not for
        with pytest.raises(BadInput, match="exact-series-8 is for a free body"):
            Scheme(scenes.get(name), example("exact_series").eighth)


@pytest.mark.slow
def test_second_kind():
    """A third retraction: orders and symplecticity in a chart that is not odd."""
    order, symplecticity = example("second_kind").main()
    assert order["verdict"] == symplecticity["verdict"] == "pass"
    wanted = {"midpoint": 1, "gauss-2": 4}
    assert {rule: round(o, 1) for (_, rule), o in orders(order).items()} == wanted


def test_the_laws_of_a_retraction_of_one_s_own():
    found = example("second_kind")
    tau, algebra, t = found.second_kind, found.so(3), sympy.Symbol("t")
    xi = sympy.Matrix([Rational(1, 3), Rational(-2, 5), Rational(1, 2)])
    g = tau.element(algebra, xi)
    left, right = tau.invariant_fields(algebra, xi)
    gaps = [g * tau.element(algebra, tau.inverse(algebra, xi)) - sympy.eye(3)]
    gaps.append(tau.inverse_left_field(algebra, xi) * left - sympy.eye(3))
    gaps.append(Retraction.inverse_left_field(tau, algebra, xi) * left - sympy.eye(3))
    gaps.append(tau.inverse_right_field(algebra, xi) * right - sympy.eye(3))
    for k in range(3):
        e = sympy.eye(3)[:, k]
        slope = tau.element(algebra, xi + t * e).diff(t).subs(t, 0)
        gaps.append(left * algebra.coordinates(g.T * slope) - e)
        gaps.append(right * algebra.coordinates(slope * g.T) - e)
    assert max(abs(e) for gap in gaps for e in evaluate_matrix(gap, 50)) < 1e-45
    group = found.body.groupoid
    assert not group.symmetric_chart and group.retraction == "second-kind"
    at = group.position([], [0, 1.5, 0], 1)
    assert at.inside and at.distance == pytest.approx(math.pi / 2 - 1.5)


def test_a_retraction_with_a_wrong_formula_is_refused():
    """A user's own is held to the axioms when the first scheme is built."""
    found = example("second_kind")
    wrong = type("Wrong", (found.SecondKind,), {"inverse": lambda self, algebra, xi: -xi})()
    scene = found.body.with_values(groupoid=found.lie_group(found.so(3), wrong))
    with pytest.raises(BadInput, match=r"is not a groupoid: .*inverses"):
        Scheme(scene, midpoint)


@pytest.mark.slow
def test_wrong_rule():
    order, symplecticity, momentum = example("wrong_rule").main()
    (case,) = order["cases"]
    assert case["verdict"] == "fail" and "below the expected 2" in case["reason"]
    assert case["diagnosis"]["cause"] == "gauge"
    evidence = case["diagnosis"]["evidence"]
    assert evidence["order_of_legendre"] == pytest.approx(1, abs=0.05)
    assert evidence["order_of_points"] == pytest.approx(2, abs=0.05)
    assert symplecticity["verdict"] == momentum["verdict"] == "pass"


def test_against_scipy():
    ours, theirs = example("against_scipy").main()
    half = len(ours) // 2
    assert ours[half:].max() < 1.01 * ours[:half].max()
    half = len(theirs) // 2
    assert theirs[half:].max() > 1.5 * theirs[:half].max()


@pytest.mark.slow
def test_heavy_top_on_group():
    top = example("heavy_top_on_group")
    assert top.main()["verdict"] == "pass"
    (case,) = check("charts", scenes=[top.scene], steps=20)["cases"]
    assert case["verdict"] == "pass"
    assert len(case["measured"]["translates"]) == 4 and case["measured"]["momentum"] < 1e-13
    stopped = [row for row in case["rows"] if row["outcome"] == "stopped"]
    assert stopped and all(row["solutions"] == 0 for row in stopped)


def test_two_thirds():
    """README's twenty lines, word for word."""
    readme = (FOLDER.parent / "README.md").read_text(encoding="utf-8")
    (block, *_) = re.findall(r"^```python\n(.*?)^```", readme, re.M | re.S)
    assert (FOLDER / "two_thirds.py").read_text(encoding="utf-8").endswith(block)


@pytest.mark.slow
def test_first_look(tmp_path, monkeypatch):
    """The notebook's cells, one after another; what the last line shows is shown."""
    monkeypatch.chdir(tmp_path)
    cells = json.loads((FOLDER / "first_look.ipynb").read_text("utf-8"))["cells"]
    names, shown = {"__name__": "__main__"}, []
    for cell in (c for c in cells if c["cell_type"] == "code"):
        body = ast.parse("".join(cell["source"])).body
        last = body.pop() if isinstance(body[-1], ast.Expr) else None
        exec(compile(ast.Module(body, []), "a cell", "exec"), names)
        if last is not None:
            shown.append(eval(compile(ast.Expression(last.value), "a cell", "eval"), names))
    assert [type(e).__name__ for e in shown] == ["Scheme", "Result", *["Figure"] * 3, "Film"]
    assert names["order"]["verdict"] == "pass" and "<svg" in names["order"]._repr_html_()
    bands = [max(abs(line.get_ydata())) for line in shown[-2].axes[0].lines]
    assert bands[0] < 0.01 < bands[1]
    assert shown[-1]._repr_html_().count("data:image/png") >= 40


@pytest.mark.slow
def test_pythagorean():
    """The energy after the encounters, and in them but for the rounding of a row."""
    found = example("pythagorean").reversible()
    assert found["largest"] <= 1e-9 and found["end"] < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("way", ["reversible", "poincare"])
def test_eccentric_orbit(way):
    found = example("eccentric_orbit").drift(way, 1000)
    assert found["band"] < 1e-9 and found["shift"] < 1e-11


def test_every_example_has_a_test():
    names = {path.stem for path in FOLDER.glob("*.[pi]*y*")}
    assert names == {n.removeprefix("test_") for n in globals() if n.startswith("test_")} - {
        "every_example_has_a_test",
        "the_laws_of_a_retraction_of_one_s_own",
        "a_retraction_with_a_wrong_formula_is_refused",
    }


@pytest.mark.slow
def test_one_step_maps():
    order, symplecticity, energy = example("one_step_maps").main()
    assert order["verdict"] == "pass"
    wanted = {"rk4": 4, "simpson-field": 2, "gauss": 4}
    assert {rule: round(o, 1) for (_, rule), o in orders(order).items()} == wanted
    for case in symplecticity["cases"]:
        assert case["verdict"] == "fail" and case["measured"]["pullback"] is None
    assert [c["verdict"] for c in energy["cases"]] == ["fail", "pass", "pass"]
