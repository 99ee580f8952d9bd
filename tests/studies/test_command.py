"""The command line: what it prints, writes and answers, and what it says to bad input."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from fractions import Fraction

import mpmath
import pytest

from discmech.integrators import Scheme, midpoint, scenes
from discmech.integrators import rules as discretisations
from discmech.studies import NAMES
from discmech.studies.command import _parser, main
from discmech.studies.options import choice_of

LIGHT = "import sys; from discmech.studies.command import main; code = main(sys.argv[1:]); "


def ask(capsys, *words):
    """(exit code, standard output, standard error) of the command, errors of argparse included."""
    try:
        code = main(list(words))
    except SystemExit as stop:
        code = stop.code
    shown = capsys.readouterr()
    return code, shown.out, shown.err


def strict(text):
    """JSON as the standard has it: no NaN, no Infinity."""
    return json.loads(text, parse_constant=pytest.fail)


def in_a_process(*words, code=None):
    python = [sys.executable] + (["-c", code] if code else ["-m", "discmech.studies.command"])
    return subprocess.run([*python, *words], capture_output=True, text=True, timeout=60)


# -- list -----------------------------------------------------------------------------------------


def test_list_names_everything(capsys):
    code, out, err = ask(capsys, "list")
    assert (code, err) == (0, "")
    for name in (*scenes.names(), *discretisations.BUILT_IN, *NAMES, "LocalGroupoid"):
        assert f"  {name}" in out
    for name in scenes.names():  # words stay apart, however long the name
        assert f"  {name} " in out and f"  {scenes.get(name).title}\n" in out


def test_list_as_json(capsys, tmp_path):
    code, out, _ = ask(capsys, "list", "--json", "-")
    found = strict(out)
    assert code == 0 and list(found) == ["scenes", "rules", "groupoids", "studies"]
    assert found["scenes"] == list(scenes.names()) and found["studies"] == list(NAMES)
    assert found["rules"][:3] == ["rectangle", "midpoint", "trapezoidal"]
    assert found["rules"] == list(discretisations.names())
    assert ask(capsys, "list", "--json", str(tmp_path / "list.json")) == (0, "", "")
    assert strict((tmp_path / "list.json").read_text()) == found


def test_every_groupoid_that_is_listed_can_be_imported(capsys):
    import discmech.integrators as integrators

    for name in strict(ask(capsys, "list", "--json", "-")[1])["groupoids"]:
        assert name in integrators.__all__


@pytest.mark.parametrize("words", [["list"], ["list", "--json", "-"]])
def test_list_loads_nothing_heavy(words):
    heavy = "('sympy', 'numba', 'matplotlib', 'scipy', 'mpmath', 'gmpy2', 'rich', 'jinja2')"
    done = in_a_process(
        *words, code=LIGHT + f"print([m for m in {heavy} if m in sys.modules], file=sys.stderr)"
    )
    assert done.returncode == 0 and done.stderr.strip() == "[]"


# -- run ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("words", "said"), [
    (("pendulum",), ""),
    (("rigid-body", "--retraction", "exponential", "--step", "8", "--on-edge", "shrink"),
     "its edge was met 6 times"),
    (("moser-veselov", "--on-edge", "bisect"), "smallest margin to the edge of the chart: 0.999"),
])  # fmt: skip
def test_run_says_how_near_the_edge_it_came(capsys, words, said):
    code, out, _ = ask(capsys, "run", *words, "--steps", "5")
    assert code == 0 and said in out and ("margin" in out) == bool(said)
    code, out, _ = ask(capsys, "run", *words, "--steps", "5", "--json", "-")
    found = json.loads(out)
    assert (found["margin"] < 1) == bool(said) and (found["edges"] > 0) == ("edge was" in said)


def test_an_unknown_policy_at_the_edge_is_told(capsys):
    code, _, err = ask(capsys, "run", "pendulum", "--on-edge", "jump")
    assert code == 2 and "on_edge is 'jump'" in err and "'bisect'" in err


def test_run_as_json(capsys):
    code, out, err = ask(capsys, "run", "heavy-top", "--rule", "midpoint", "--step", "1/100",
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
def test_run_keeps_each_kth_row(capsys, steps, every, times):
    _, out, _ = ask(capsys, "run", "pendulum", "--step", "0.5", "--steps", str(steps), "--every",
                    str(every), "--json", "-")  # fmt: skip
    assert strict(out)["t"] == [0.5 * k for k in times]


def test_run_at_30_digits_writes_decimals(capsys):
    words = ("run", "pendulum", "--step", "1/3", "--steps", "3", "--digits", "30", "--json", "-")
    found = strict(ask(capsys, *words)[1])
    assert found["digits"] == 30
    assert found["t"][1] == "0.333333333333333333333333333333"  # the fraction, not its double
    double = strict(ask(capsys, *words[:-4], "--json", "-")[1])
    for name in ("t", "x", "u", "mu"):
        column = found[name] if name == "t" else [row[0] for row in found[name]]
        rounded = double[name] if name == "t" else [row[0] for row in double[name]]
        assert all(isinstance(text, str) for text in column)
        assert [float(mpmath.mpf(text)) for text in column] == pytest.approx(rounded, abs=1e-15)
    assert len(found["x"][3][0].replace("-", "").replace(".", "").lstrip("0")) == 30


def test_run_without_base(capsys):
    code, out, _ = ask(capsys, "run", "rigid-body", "--steps", "2", "--json", "-")
    assert code == 0 and strict(out)["x"] == [[], [], []]


def test_run_takes_the_scene_s_own_step_and_duration(capsys):
    found = strict(ask(capsys, "run", "kepler", "--every", "1000", "--json", "-")[1])
    assert (found["step"], found["steps"]) == (0.02, 250)


def test_run_backwards_returns(capsys):
    """A negative step runs Φ₋ₕ; for a self-adjoint rule that is the way back."""
    code, out, _ = ask(capsys, "run", "pendulum", "--rule", "midpoint", "--step=-1/10",
                       "--steps", "4", "--json", "-")  # fmt: skip
    found = strict(out)
    assert code == 0 and found["t"][-1] == -0.4
    flow = Scheme(scenes.get("pendulum"), midpoint).flow("1/10")
    back = flow.trajectory(4, x0=found["x"][-1], mu0=found["mu"][-1])
    assert back.x[-1] == pytest.approx([2], abs=1e-14)


@pytest.mark.parametrize(
    "step",
    ["-0.1", "-1/10", "-1e-1"],
)
def test_a_negative_step_may_stand_apart(capsys, step):
    assert ask(capsys, "run", "pendulum", "--step", step, "--steps", "2")[0] == 0


@pytest.mark.parametrize(("step", "said"), [("5", "do not resolve this motion"), ("1/50", "")])
def test_run_says_that_its_steps_do_not_resolve_the_motion(capsys, step, said):
    """At a step of 5 the planet is 80 orbits away, and Störmer–Verlet has nothing to solve."""
    code, out, err = ask(capsys, "run", "kepler", "--step", step)
    assert code == 0 and "largest energy error" in out
    assert said in err and bool(said) == bool(err)


def test_a_scene_that_takes_no_rule_says_so(capsys):
    words = ("order", "moser-veselov", "--digits", "16", "--rule")
    assert "midpoint has no part in it" in ask(capsys, *words, "midpoint")[1]
    assert "no part" not in ask(capsys, *words, "own")[1]
    words = ("verify", "examples/two_thirds.py", "--scene", "moser-veselov", "--study", "energy")
    assert "two-thirds has no part in it" in ask(capsys, *words, "--steps", "100")[1]


def test_a_file_that_is_none_of_python_s_is_told(capsys, tmp_path):
    (tmp_path / "notes.md").write_text("# my rule")
    for path in (tmp_path, tmp_path / "notes.md"):
        code, _, err = ask(capsys, "verify", str(path))
        assert code == 2 and f"{path} is no Python file" in err


def test_run_prints_something_to_read(capsys, tmp_path):
    file = tmp_path / "run.json"
    code, out, _ = ask(capsys, "run", "kepler", "--steps", "3", "--json", str(file))
    assert code == 0 and "kepler by trapezoidal: 3 steps of 0.02" in out and "mu at t = 0.06" in out
    assert strict(file.read_text())["steps"] == 3
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["run.json"]


def test_a_run_that_stops_in_the_middle_writes_what_it_has(capsys, tmp_path):
    file = tmp_path / "run.json"
    code, out, err = ask(capsys, "run", "pendulum", "--rule", "midpoint", "--step", "2",
                         "--steps", "100", "--json", str(file))  # fmt: skip
    assert code == 1
    assert "pendulum with midpoint: Newton did not converge at step 2, t = 4" in err
    assert "smaller step" in err and "Traceback" not in err
    found = strict(file.read_text())
    assert found["steps"] == 2 and "did not converge" in found["failure"]
    assert found["t"] == [0, 2] or found["t"] == [0, 2, 4]
    assert "2 steps" in out


# -- studies --------------------------------------------------------------------------------------

TIMED = ("work-precision", "savings")  # no two runs of these give the same numbers
SMALL = {
    "order": ["pendulum", "--steps", "100"],
    "symplecticity": ["heavy-top", "--steps", "24"],
    "momentum": ["lagrange-top", "--steps", "500"],
    "energy": ["kepler", "--steps", "2000"],
    "work-precision": ["pendulum", "--steps", "50"],
    "stability": ["harmonic", "--steps", "50"],
    "charts": ["moser-veselov", "--steps", "2"],
    "extremes": ["charged-particle", "--steps", "50"],
    "savings": ["pendulum", "--steps", "50"],
}
ALONE = {"work-precision": ["--peer", "none"]}  # what makes a study one case


@pytest.mark.parametrize("study", NAMES)
def test_each_study_as_a_table_and_as_json(capsys, tmp_path, study):
    words = [study, *SMALL[study], "--rule", "midpoint", "--digits", "16", *ALONE.get(study, [])]
    code, out, err = ask(capsys, *words, "--json", "-")
    found = strict(out)  # nothing else on standard output
    assert (code, err) == (0, "")
    assert (found["study"], found["verdict"], found["schema"]) == (study, "pass", 1)
    assert found["command"] == "discmech " + " ".join(
        [
            study,
            SMALL[study][0],
            "--rule",
            "midpoint",
            "--digits",
            "16",
            *ALONE.get(study, []),
            *SMALL[study][1:],
        ]
    )
    (case,) = found["cases"]
    assert {
        "scene",
        "rule",
        "retraction",
        "digits",
        "verdict",
        "expected",
        "measured",
        "rows",
    } <= set(case)
    assert case["rows"] and case["expected"]
    assert (
        set(case["measured"])
        == {
            "order": {"order", "interval", "points"},
            "symplecticity": {"pullback", "poisson", "residual"},
            "momentum": {"drift"},
            "energy": {"band", "slope", "slope_interval", "edge_slopes"},
            "extremes": {"fine", "coarse"},
            "savings": {"times"},
            "charts": {
                "residual",
                "pullback",
                "poisson",
                "momentum",
                "factorisation",
                "distance",
                "operator",
                "newton_max",
                "chart_turn",
                "margin",
                "starts",
                "steps",
                "changes",
                "translates",
                "stopped",
            },
            "stability": {"stable_to", "intervals", "resonances", "off_circle", "runs"},
            "work-precision": {"x", "y", "best", "cost", "ratio", "cut", "setup"},
        }[study]
    )
    file = tmp_path / "result.json"
    code, out, err = ask(capsys, *words, "--json", str(file))
    assert (code, err) == (0, "") and case["scene"] in out and "pass" in out
    again = strict(file.read_text())
    if study not in TIMED:
        assert again["cases"][0]["measured"] == case["measured"]


def test_controls_by_name(capsys):
    code, out, _ = ask(capsys, "symplecticity", "heavy-top", "--control", "Heun", "--control",
                       "damped residual", "--digits", "16", "--json", "-")  # fmt: skip
    cases = strict(out)["cases"]
    assert code == 0
    assert [(c["rule"], c["control"]) for c in cases] == [("Heun", True), ("damped residual", True)]


def test_the_command_of_a_result_names_its_controls():
    from discmech.studies.options import as_typed

    words = ["symplecticity", "heavy-top", "--control", "damped residual"]
    again = _parser().parse_args(shlex.split(as_typed(_parser().parse_args(words)))[1:])
    assert choice_of(again).controls == ("damped residual",)


def test_a_retraction_is_exchanged_and_the_command_says_so():
    from discmech.studies.case import plain_cases

    words = ["order", "heavy-top", "pendulum", "--rule", "midpoint", "--digits", "16"]
    both = ["--retraction", "exponential", "--retraction", "cayley"]
    cases = plain_cases("order", choice_of(_parser().parse_args([*words, *both])), (16,))
    assert [c.scene.groupoid.retraction for c in cases] == ["exponential", "cayley", None]
    for case in cases:
        again = choice_of(_parser().parse_args(shlex.split(case.command)[1:]))
        ((scene, _),) = again.pairs()
        assert scene.groupoid.name == case.scene.groupoid.name


def test_no_scene_is_every_scene_and_a_retraction_leaves_pairs_in():
    everything = choice_of(_parser().parse_args(["order"]))
    assert {s.name for s, _ in everything.pairs()} == set(scenes.names())
    cayley = choice_of(_parser().parse_args(["order", "--retraction", "cayley"]))
    assert {s.name for s, _ in cayley.pairs()} == set(scenes.names())


@pytest.mark.parametrize(("verdict", "code"), [("pass", 0), ("fail", 1), ("inconclusive", 3)])
def test_exit_codes(capsys, monkeypatch, verdict, code):
    from discmech.studies import get
    from discmech.studies.case import Verdict

    module = get("momentum")
    monkeypatch.setattr(
        module, "measure", lambda case, progress: {"measured": {"drift": {}}, "rows": []}
    )
    monkeypatch.setattr(module, "judge", lambda case, measurement: Verdict(verdict, "so it is"))
    assert ask(capsys, "momentum", "kepler", "--json", "-")[0] == code


def test_not_a_number_never_reaches_the_json(capsys, monkeypatch):
    from discmech.studies import get

    nothing = {"measured": {"drift": {"J": float("nan")}}, "steps": 1,
               "rows": [{"step": 1, "drift": {"J": float("inf")}}]}  # fmt: skip
    monkeypatch.setattr(get("momentum"), "measure", lambda case, progress: nothing)
    code, out, _ = ask(capsys, "momentum", "kepler", "--json", "-")
    assert code == 1
    case = strict(out)["cases"][0]
    assert case["measured"] == {"drift": {"J": None}} and case["rows"][0]["drift"] == {"J": None}


# -- bad input ------------------------------------------------------------------------------------

BAD = [
    ("run pendulm", 'there is no scene "pendulm": did you mean pendulum?'),
    ("order heavytop", "did you mean heavy-top?"),
    ("order nothing-like-it", "there are harmonic, pendulum, double-pendulum"),
    ("run pendulum --rule midpont", 'there is no rule "midpont": did you mean midpoint?'),
    ("energy pendulum --rule verlet", "there are rectangle, midpoint, trapezoidal"),
    ("run pendulum --retraction caylee", 'there is no retraction "caylee": did you mean cayley?'),
    ("order pendulum --retraction exp", 'there is no retraction "exp"'),
    ("symplecticity --control Huen", 'there is no control "Huen": there are classical'),
    ("run pendulum --step 0", "a step of 0 goes nowhere"),
    ("run pendulum --step nan", '--step is "nan", which is no number'),
    ("run pendulum --step inf", '--step is "inf", which is no number'),
    ("run pendulum --step a", 'write a decimal ("0.1") or a fraction ("1/3")'),
    ("run pendulum --step 1/0", '--step is "1/0", which is no number'),
    ("run pendulum --step __import__('os')", "which is no number"),
    ("run pendulum --steps 0", "--steps is '0': give a whole number from 1"),
    ("run pendulum --steps -3", "--steps is '-3'"),
    ("run pendulum --steps 1.5", "--steps is '1.5'"),
    ("run pendulum --steps abc", "--steps is 'abc'"),
    ("run pendulum --every 0", "--every is '0'"),
    ("run pendulum --digits 5", "--digits is 5: give 16 (double precision) up to 10000"),
    ("run pendulum --digits many", "--digits is 'many'"),
    ("order pendulum --steps 0", "--steps is '0'"),
    ("order pendulum --steps abc", "--steps is 'abc'"),
    ("order pendulum --digits 15", "--digits is 15"),
    ("momentum harmonic", "applies to none of the chosen scenes (harmonic)"),
    ("work-precision pendulum --peer lsode", 'there is no peer "lsode": there are DOP853'),
    ("work-precision pendulum --x hours", '--x is "hours": choose seconds, steps'),
    ("work-precision pendulum --y speed", '--y is "speed": choose error, error-x'),
    ("work-precision pendulum --periods -1", "--periods is '-1'"),
    ("work-precision pendulum --periods 9999999999999", "from 1 to 1000000000000"),
    ("work-precision pendulum --peer none --peer DOP853", "name no other beside it"),
    ("work-precision pendulum --rule imex", "imex can be used on none of the chosen"),
    ("work-precision pendulum --rule midpoint --peer none --y momentum", "--y momentum does not"),
    ("stability kepler --control Heun", "controls run on harmonic and spring-pendulum"),
    ("extremes pendulum --extreme sleeping", 'pendulum has no extreme "sleeping": it has "mass'),
    ("extremes --extreme foo", 'there is no extreme "foo": there are "mass 1e100"'),
    ("work-precision pendulum --budget 0", "--budget is '0': give seconds"),
    ("work-precision pendulum --budget inf", "--budget is 'inf': give seconds"),
    ("work-precision pendulum --digits 50", "double precision"),
    ("extremes kepler --extreme nowhere", 'there is no extreme "nowhere": there are'),
    ("report nowhere", 'there is no scene "nowhere"'),
    ("report kepler --steps 0", "--steps is '0'"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "message"), BAD)
def test_bad_input_is_one_sentence_on_standard_error(capsys, line, message):
    code, out, err = ask(capsys, *line.split())
    assert (code, out) == (2, "")
    assert message in err and err.startswith("discmech: ")
    assert err.count("\n") == 1 and err.rstrip()[-1] in ".?)"


@pytest.mark.parametrize(
    ("line", "message"),
    [("ordr", "choose from 'list', 'run', 'order'"), ("", "required: COMMAND"),
     ("run", "required: scene"), ("list --jsn x", "unrecognized arguments: --jsn"),
     ("order --steps", "expected one argument")],
)  # fmt: skip
def test_a_line_that_is_no_command_shows_the_usage(capsys, line, message):
    code, out, err = ask(capsys, *line.split())
    assert (code, out) == (2, "") and "usage: discmech" in err
    assert message.replace("'", "") in err.replace("'", "")


@pytest.mark.parametrize("words", [["list"], ["run", "pendulum", "--steps", "2"],
                                   ["energy", "harmonic", "--steps", "50"]])  # fmt: skip
def test_a_file_that_cannot_be_written(capsys, tmp_path, words):
    for target in (tmp_path / "missing" / "a.json", tmp_path):
        code, out, err = ask(capsys, *words, "--json", str(target))
        assert (code, out) == (2, "") and "cannot be written" in err and err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == []


def test_a_failed_write_leaves_the_old_file(capsys, tmp_path, monkeypatch):
    file = tmp_path / "list.json"
    file.write_text("old")

    def fail(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    code, _, err = ask(capsys, "list", "--json", str(file))
    assert code == 2 and "No space left on device" in err
    assert file.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["list.json"]


def test_where_the_result_goes_is_looked_at_before_the_study_runs(capsys, tmp_path, monkeypatch):
    from discmech.studies import get

    monkeypatch.setattr(get("energy"), "measure", lambda *_: pytest.fail("measured in vain"))
    assert ask(capsys, "energy", "--json", str(tmp_path / "missing" / "a.json"))[0] == 2
    (tmp_path / "file").touch()
    code, _, err = ask(capsys, "energy", "--folder", str(tmp_path / "file"))
    assert code == 2 and "file cannot be written" in err and err.count("\n") == 1


def test_a_study_by_itself_gives_its_page_figures_and_tables(capsys, tmp_path):
    words = ["stability", "harmonic", "--rule", "midpoint"]
    code, out, _ = ask(capsys, *words, "--folder", str(tmp_path / "new"))
    assert code == 0 and f"page: {tmp_path}/new/index.html" in out.replace("\n", "")
    figures = [f"figures/stability-linear.{kind}" for kind in ("png", "svg")]
    tables = [f"tables/stability{end}" for end in (".csv", "-rows.csv", ".json", ".tex")]
    for name in figures + tables:
        assert (tmp_path / "new" / name).stat().st_size > 100
    text = (tmp_path / "new" / "index.html").read_text()
    assert " ".join(words) in text and scenes.get("harmonic").title in text
    assert scenes.get("kepler").title not in text


@pytest.mark.parametrize(
    "line",
    ["run pendulum --step 1e400 --steps 2", "run pendulum --step 1e200 --steps 2",
     "run pendulum --step 1e400 --steps 1 --digits 20", "run pendulum --step 1e-30",
     "run pendulum --steps 100000000000000", "run pendulum --step 1e-400 --steps 2"],
)  # fmt: skip
def test_numbers_beyond_the_machine_are_refused_in_words(capsys, line):
    code, _, err = ask(capsys, *line.split())
    assert code in (1, 2) and err.startswith("discmech: ") and err.count("\n") == 1


# -- as a process ---------------------------------------------------------------------------------


def test_bad_input_as_a_process():
    done = in_a_process("run", "pendulum", "--rule", "trapez")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == 'discmech: there is no rule "trapez": did you mean trapezoidal?\n'


def test_a_run_as_a_process_is_json_alone():
    """No progress bar, no warning, no notice of a compiler beside it."""
    done = in_a_process("run", "pendulum", "--steps", "3", "--json", "-")
    assert (done.returncode, done.stderr) == (0, "")
    assert strict(done.stdout)["steps"] == 3


def test_a_reader_that_goes_away_is_no_error():
    done = subprocess.run(
        [sys.executable, "-c",
         "import subprocess, sys\n"
         "p = subprocess.Popen([sys.executable, '-m', 'discmech.studies.command', 'list'],"
         " stdout=subprocess.PIPE, stderr=subprocess.PIPE)\n"
         "p.stdout.close()\n"
         "print(p.stderr.read().decode()); sys.exit(p.wait())"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert "Traceback" not in done.stdout


def test_bad_input_loads_neither_sympy_nor_numba():
    done = in_a_process("run", "pendulm", code=LIGHT + "print(code, 'numba' in sys.modules)")
    assert done.stdout.split() == ["2", "False"]


def test_the_console_script_is_this_function():
    import tomllib
    from pathlib import Path

    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    assert project["project"]["scripts"] == {"discmech": "discmech.studies.command:main"}
