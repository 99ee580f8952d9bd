"""Programs as integrators: the examples in C and in Python, beside the rule that they are."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

from discmech import Scheme, external, scenes, trapezoidal
from discmech.integrators import BadInput
from discmech.studies import check
from tests.imports import ROOT

FOLDER = ROOT / "examples" / "external"
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


@pytest.fixture(scope="module")
def in_c(tmp_path_factory):
    """The example in C, compiled."""
    if COMPILER is None:
        pytest.skip("this machine has no C compiler")
    built = tmp_path_factory.mktemp("built") / "verlet"
    command = [COMPILER, "-O2", "-Wall", "-Werror", "-o", built, FOLDER / "verlet.c", "-lm"]
    subprocess.run(command, check=True)
    return external([built], order=2, symplectic=True, keeps=("momentum",), name="in-C")


@pytest.fixture(scope="module")
def in_python():
    """The example in Python without numpy."""
    return external([sys.executable, "-S", FOLDER / "verlet.py"], order=2, symplectic=True)


@pytest.mark.parametrize("language", ["in_c", "in_python"])
@pytest.mark.parametrize("scene", ["pendulum", "kepler"])
def test_a_program_runs_as_the_rule_that_it_is(request, language, scene):
    program = request.getfixturevalue(language)
    scheme = Scheme(scenes.get(scene), program)
    run = scheme.flow("1/50").trajectory(400, every=4)
    same = Scheme(scenes.get(scene), trapezoidal).flow("1/50").trajectory(400, every=4)
    for part in ("t", "x", "mu"):  # a rule's u leads to the next row
        assert getattr(run, part) == pytest.approx(getattr(same, part), abs=2e-12)
    again = scheme.flow("1/50").trajectory(400, every=4)
    assert np.array_equal(run.x, again.x) and np.array_equal(run.mu, again.mu)


@pytest.mark.slow
def test_a_program_is_judged(in_c):
    for study in ("order", "symplecticity"):
        found = check(study, ["pendulum"], [in_c], digits=[16])
        assert found["verdict"] == "pass", found["cases"][0]["reason"]


def test_the_functions_beside_a_program_are_part_of_its_key():
    """Results of a program were once remembered after an edit of what reads its states."""

    def key(claim, factor):
        beside = {"read": lambda q, p: (q, p), "write": lambda q, p: (q, p)}
        return external(["cat"], 2, files=(), **{**beside, claim: lambda q, p: (q, factor * p)})

    for claim in ("read", "write"):
        assert key(claim, 1).digest == key(claim, 1).digest != key(claim, 2).digest


def test_a_scene_that_a_program_does_not_know_is_its_own_sentence(in_c, in_python):
    for program in (in_c, in_python):
        with pytest.raises(BadInput, match="I know the scenes pendulum and kepler only"):
            Scheme(scenes.get("henon-heiles"), program).flow("1/50").trajectory(4)


FILE = """
from discmech import external
here = external(["./code.sh", "--json"], order=2)
named = external(["sh", "code.sh"], name="by-name")
"""


def test_a_relative_command_is_meant_from_its_file(tmp_path, monkeypatch):
    from discmech.studies.core.userfile import load

    folder = tmp_path / "there"
    folder.mkdir()
    folder.joinpath("code.sh").write_text("#!/bin/sh\nread line\npwd >&2\nexit 7\n")
    folder.joinpath("code.sh").chmod(0o755)
    folder.joinpath("mine.py").write_text(FILE)
    monkeypatch.chdir(tmp_path)
    rules = load("there/mine.py").rules
    assert set(rules) == {"code", "by-name"}
    for rule in rules.values():
        with pytest.raises(BadInput, match=f"exit code 7.*{folder}$"):
            Scheme(scenes.get("pendulum"), rule).flow("1/50").trajectory(4)
    folder.joinpath("mine.py").write_text(FILE.replace("./code.sh", "./none"))
    refused = load("there/mine.py").refused
    assert list(refused) == ["here"] and "there/none" in refused["here"]
    assert "mine.py, line 3: there is no program" in refused["here"]


def test_velocities_have_a_key_of_their_own(tmp_path):
    """A program of velocities is asked and answers in v, and the bench has mass times v."""
    still = """import json, sys
for asked in map(json.loads, sys.stdin):
    rows = asked["steps"] // asked["every"] + 1
    print(json.dumps({key: [asked[key]] * rows for key in ("x", KEY)}), flush=True)
"""
    heavy = scenes.get("pendulum").with_values(parameters={"mass": 4})
    for key in ("v", "mu"):
        code = tmp_path / f"{key}.py"
        code.write_text(still.replace("KEY", repr(key)))
        flow = Scheme(heavy, external([sys.executable, "-S", code], state="qv")).flow("1/50")
        if key == "v":
            assert flow.trajectory(2, mu0=[8]).mu.tolist() == [[8]] * 3
        else:
            with pytest.raises(BadInput, match="KeyError: 'mu'"):
                flow.trajectory(2)
    code.write_text(still.replace("asked[key]", "[1]").replace("KEY", "'mu'"))
    with pytest.raises(BadInput, match=r"without 'v', .*: give {\"x\": rows, \"v\": rows}"):
        flow.trajectory(2)


def test_threads_ask_in_turn(in_python):
    """An ensemble, and the map of stability, run side by side in threads."""
    from concurrent.futures import ThreadPoolExecutor

    flow = Scheme(scenes.get("kepler"), in_python).flow("1/50")
    with ThreadPoolExecutor(4) as pool:
        ends = list(pool.map(lambda k: flow.trajectory(20 + k % 3).x[-1], range(24)))
    for k, end in enumerate(ends):
        assert np.array_equal(end, ends[k % 3])


def test_claims_are_checked_as_of_a_black_box():
    for more, words in (({"order": 0}, "order"), ({"symplectic": 1.5}, "symplectic"),
                        ({"colour": 1}, "colour"), ({"state": "vq"}, "state")):  # fmt: skip
        with pytest.raises(BadInput, match=words):
            external(["sh"], **more)


def test_commands_for_formulas_say_what_a_program_is(in_python, tmp_path, capsys):
    from discmech.studies.command import main

    file = tmp_path / "mine.py"
    command = [sys.executable, "-S", str(FOLDER / "verlet.py")]
    file.write_text(f"from discmech import external\nverlet = external({command!r}, order=2)\n")
    assert main(["run", "pendulum", "--rule", f"{file}:verlet", "--steps", "10"]) == 0
    assert "10 steps" in capsys.readouterr().out
    assert main(["explain", "pendulum", f"{file}:verlet"]) == 2
    assert "is a program, so there are no equations" in capsys.readouterr().err


def test_a_start_may_be_rounded_on_its_way():
    from discmech import black_box

    @black_box(order=1, runs=True)
    def euler(q, p, h, steps, every, system):
        mass = 0.1  # which doubles do not have: p/m·m is not p
        rows = [(q, p)]
        for _ in range(steps):
            q, p = q + h * p, p - h * system.gradient(q, p)
            rows.append((q, p))
        qs, ps = (np.array(part[::every]) for part in zip(*rows, strict=True))
        return qs, ps / mass * mass

    flow = Scheme(scenes.get("pendulum"), euler).flow("1/50")
    starts = np.random.default_rng().uniform(1, 2, 20)
    for mu in starts:
        assert flow.trajectory(4, mu0=[mu]).mu[0] == [mu]
