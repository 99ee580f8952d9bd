"""discmech run: steps, rows and digits, what it prints and writes, and runs that stop."""

import json
from fractions import Fraction

import mpmath
import pytest

from discmech.integrators import Scheme, midpoint, scenes
from tests.studies.commands import strict


@pytest.mark.dear(but=("words0",))
@pytest.mark.parametrize(("words", "said"), [
    (("pendulum", "midpoint"), ""),
    (("rigid-body", "--retraction", "exponential", "--step", "8", "--on-edge", "shrink"),
     "its edge was met 6 times"),
    (("moser-veselov", "--on-edge", "bisect"), "smallest margin to the edge of the chart: 0.999"),
])  # fmt: skip
def test_run_says_how_near_the_edge_it_came(ask, words, said):
    code, out, _ = ask("run", *words, "--steps", "5")
    assert code == 0 and said in out and ("margin" in out) == bool(said)
    code, out, _ = ask("run", *words, "--steps", "5", "--json", "-")
    found = json.loads(out)
    assert (found["margin"] < 1) == bool(said) and (found["edges"] > 0) == ("edge was" in said)


@pytest.mark.parametrize(("scene", "rule"), [
    ("lotka-volterra-half", "degenerate-gauss-1"), ("lotka-volterra", "projected-gauss-1"),
])  # fmt: skip
def test_a_one_form_runs_by_a_method_for_it(ask, scene, rule):
    """The rule of other scenes leaves μ = ϑ(x), and stopped at t = 2.1."""
    code, out, _ = ask("run", scene, "--steps", "5", "--json", "-")
    assert code == 0 and json.loads(out)["rule"] == rule


@pytest.mark.slow
def test_run_as_json(ask):
    code, out, err = ask("run", "heavy-top", "--rule", "midpoint", "--step", "1/100",
                         "--steps", "5", "--json", "-")  # fmt: skip
    found = strict(out)
    assert (code, err) == (0, "")
    assert {"scene", "rule", "step", "steps", "t", "x", "u", "mu", "newton", "seconds"} <= set(
        found
    )
    assert (found["scene"], found["rule"], found["retraction"]) == (
        "heavy-top",
        "midpoint",
        "cayley",
    )
    assert (found["step"], found["steps"], found["digits"]) == (0.01, 5, 16)
    assert len(found["t"]) == len(found["x"]) == len(found["u"]) == len(found["mu"]) == 6
    assert {len(row) for part in ("x", "u", "mu") for row in found[part]} == {3}
    assert found["newton"]["mean"] <= found["newton"]["max"] < 20
    assert found["seconds"] >= 0 and found["failure"] is None
    run = Scheme(scenes.get("heavy-top"), midpoint).flow(Fraction(1, 100)).trajectory(5)
    assert found["mu"] == run.mu.tolist()  # floats survive JSON to the last bit


@pytest.mark.parametrize(("steps", "every", "times"), [(6, 3, [0, 3, 6]), (7, 3, [0, 3, 6]),
                                                       (2, 5, [0])])  # fmt: skip
def test_run_keeps_each_kth_row(ask, steps, every, times):
    _, out, _ = ask("run", "pendulum", "--step", "0.5", "--steps", str(steps), "--every",
                    str(every), "--json", "-")  # fmt: skip
    assert strict(out)["t"] == [0.5 * k for k in times]


def test_run_at_30_digits_writes_decimals(ask):
    words = ("run", "pendulum", "--step", "1/3", "--steps", "3", "--digits", "30", "--json", "-")
    found = strict(ask(*words)[1])
    assert found["digits"] == 30
    assert found["t"][1] == "0.333333333333333333333333333333"  # the fraction, not its double
    double = strict(ask(*words[:-4], "--json", "-")[1])
    for name in ("t", "x", "u", "mu"):
        column = found[name] if name == "t" else [row[0] for row in found[name]]
        rounded = double[name] if name == "t" else [row[0] for row in double[name]]
        assert all(isinstance(text, str) for text in column)
        assert [float(mpmath.mpf(text)) for text in column] == pytest.approx(rounded, abs=1e-15)
    assert len(found["x"][3][0].replace("-", "").replace(".", "").lstrip("0")) == 30


def test_run_without_base(ask):
    code, out, _ = ask("run", "rigid-body", "--steps", "2", "--json", "-")
    assert code == 0 and strict(out)["x"] == [[], [], []]


def test_run_chooses_its_step_for_a_tolerance(ask):
    words = ("run", "pendulum", "--rule", "gauss-3", "--tolerance", "1e-8")
    found = strict(ask(*words, "--json", "-")[1])
    assert found["chosen"]["error"] <= 1e-8 and found["steps"] == found["chosen"]["steps"]
    assert "chosen: step" in ask(*words)[1]
    code, _, err = ask(*words, "--step", "1/10")
    assert code == 2 and "give a step, or a tolerance" in err


def test_run_takes_the_scene_s_own_step_and_duration(ask):
    found = strict(ask("run", "kepler", "--every", "1000", "--json", "-")[1])
    assert (found["step"], found["steps"]) == (0.02, 250)


@pytest.mark.parametrize("step", ["-0.1", "-1/10", "-1e-1"])
def test_a_negative_step_may_stand_apart(ask, step):
    assert ask("run", "pendulum", "--step", step, "--steps", "2")[0] == 0


@pytest.mark.parametrize(("step", "said"), [("5", "do not resolve this motion"), ("1/50", "")])
def test_run_says_that_its_steps_do_not_resolve_the_motion(ask, step, said):
    """At a step of 5 the planet is 80 orbits away, and Störmer–Verlet has nothing to solve."""
    code, out, err = ask("run", "kepler", "--step", step)
    assert code == 0 and "largest energy error" in out
    assert said in err and bool(said) == bool(err)


def test_run_prints_something_to_read(ask, tmp_path):
    file = tmp_path / "run.json"
    code, out, _ = ask("run", "kepler", "--steps", "3", "--json", str(file))
    assert code == 0 and "kepler by trapezoidal: 3 steps of 0.02" in out and "mu at t = 0.06" in out
    assert strict(file.read_text())["steps"] == 3
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["run.json"]


def test_a_run_that_stops_in_the_middle_writes_what_it_has(ask, tmp_path):
    file = tmp_path / "run.json"
    code, out, err = ask("run", "pendulum", "--rule", "midpoint", "--step", "2",
                         "--steps", "100", "--json", str(file))  # fmt: skip
    assert code == 1
    assert "pendulum with midpoint: Newton did not converge at step 2, t = 4" in err
    assert "smaller step" in err and "Traceback" not in err
    found = strict(file.read_text())
    assert found["steps"] == 2 and "did not converge" in found["failure"]
    assert found["t"] == [0, 2] or found["t"] == [0, 2, 4]
    assert "2 steps" in out


def test_a_run_is_written_into_a_folder_with_rows_that_can_be_read_again(ask, tmp_path):
    from discmech import recorded

    folder = tmp_path / "run"
    assert ask("run", "oscillator", "--steps", "4", "--folder", str(folder))[0] == 0
    assert (folder / "control.png").is_file()
    asked = ("pendulum", "--rule", "midpoint", "--steps", "80", "--folder", str(folder))
    assert ask("run", *asked)[0] == 0  # a folder of ours is written anew
    names = {path.name for path in folder.glob("[!.]*")}
    assert {"run.json", "run.csv", "phase.pdf", "energy.svg", "time.png"} <= names
    assert not {"base.png", "control.png"} & names  # of one it is that against time
    head = (folder / "time.png").read_bytes()[16:24]  # of as many dots as a study's figure
    assert int.from_bytes(head[:4], "big") == 640 and int.from_bytes(head[4:], "big") == 490
    assert b">x" in (folder / "time.svg").read_bytes()  # text stays text
    found = strict((folder / "run.json").read_text("utf-8"))
    again = recorded(str(folder / "run.csv"), scene="pendulum")
    assert again.begins_at(scenes.get("pendulum")) and len(found["t"]) == 81
    (folder / "run.csv").write_text("mine")
    code, _, err = ask("run", *asked)
    assert code == 2 and "run.csv is there, and is not as discmech wrote it" in err
    assert ask("run", "kepler", "--steps", "4", "--folder", str(tmp_path / "two"))[0] == 0
    assert (tmp_path / "two" / "base.png").is_file() and (tmp_path / "two" / "time.png").is_file()
