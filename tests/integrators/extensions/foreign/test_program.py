"""A program that answers JSON lines: what goes to and fro, and a sentence for what goes wrong."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from discmech.integrators import BadInput
from discmech.integrators.extensions.foreign.program import Program, ProgramFailure

#: reads lines and answers them as `answer(asked)` says; `say` writes a line
FRAME = """
import json, os, signal, sys, time
def say(text): print(text, flush=True)
def rows(asked, count=None):
    count = asked["steps"] // asked["every"] + 1 if count is None else count
    return {"x": [asked["x"]] * count, "mu": [asked["mu"]] * count}
def loud(*lines): print(*lines, sep="\\n", file=sys.stderr, flush=True)
"""


@pytest.fixture
def made(tmp_path):
    """program(body, …): a program whose answer to each `asked` is the body."""
    programs = []

    def make(body: str, first: str = "", **more) -> Program:
        loop = "\nfor asked in map(json.loads, sys.stdin):\n    "
        tmp_path.joinpath("code.py").write_text(FRAME + first + loop + body.replace("\n", "\n    "))
        programs.append(Program([sys.executable, "-S", "code.py"], tmp_path, **more))
        return programs[-1]

    yield make
    for program in programs:
        program.close(0.0)


def run(program, x=(2.0,), mu=(0.5,), steps=4, every=2, scene="pendulum"):
    return program.run(np.array(x), np.array(mu), 0.1, steps, every, scene, {"length": 1})


def test_doubles_come_and_go_unchanged(made):
    generator = np.random.default_rng()
    values = generator.integers(1, 2**63, 200).astype(np.uint64).view(float)
    values = np.concatenate([values[np.isfinite(values)], [5e-324, 1.7976931348623157e308, -0.0]])
    x, mu = run(made("say(json.dumps(rows(asked)))"), values, values[:3])
    assert x.shape == (3, len(values)) and mu.shape == (3, 3)
    assert all(row.tobytes() == values.tobytes() for row in x)


@pytest.mark.slow
def test_it_is_started_once_and_told_all(made):
    program = made("n = n + 1\nasked.update(rows(asked)); loud(n, sorted(asked)); "
                   "say(json.dumps(asked)) if n < 500 else say(1)", "n = 0")  # fmt: skip
    for _ in range(499):
        run(program)
    with pytest.raises(ProgramFailure, match=r"500 \| \['every', 'h', 'mu', 'parameters', 'scene', "
                                             r"'steps', 'x'\]"):  # fmt: skip
        run(program)


@pytest.mark.parametrize(("body", "words"), [
    ("loud('a', 'b', 'c', 'out of range'); sys.exit(3)",
     r"ended with exit code 3, asked for 4 steps of pendulum: .*ends: b \| c \| out of range"),
    ("os.kill(os.getpid(), signal.SIGSEGV)", "was ended by the signal SIGSEGV"),
    ("1 / 0", "exit code 1, .* ends: .*ZeroDivisionError"),
    ("os.close(1); time.sleep(9)", "closed its standard output"),
    ("say('Step 1 of 4')", "printed 'Step 1 of 4' where an answer is due"),
    ("say('[1, 2]')", r"printed '\[1, 2\]' where an answer"),
    ("say('[' * 9999)", "where an answer is due"),
    ("sys.stdout.buffer.write(bytes(range(128, 256)) + b'\\n'); sys.stdout.flush()",
     "where an answer is due"),
    ("print(end='x' * 999_999, flush=True)", "without the end of a line"),
    ("say(json.dumps({'x': [[2.0]] * 3}))", "without 'mu', .*there is x"),
    ("say('{}')", "without 'x', .* there is nothing"),
    ("say(json.dumps(rows(asked, 2)))", "2 rows of 1 numbers in 'x', .* give 3 rows of 1 numbers"),
    ("say(json.dumps({'x': [[2.0, 1]] * 3, 'mu': [[0.5]] * 3}))", "3 rows of 2 numbers in 'x'"),
    ("say(json.dumps({'x': [[2.0], [2, 1], [2]], 'mu': [[0.5]] * 3}))", "rows of 1 and of 2"),
    ("say(json.dumps({'x': [2.0, 2, 2], 'mu': [[0.5]] * 3}))", "2.0 as row 0, which is no list"),
    ("say(json.dumps({'x': {'a': 1}, 'mu': [[0.5]] * 3}))", "which is no list"),
    ("say(json.dumps({'x': [['2.0']] * 3, 'mu': [[0.5]] * 3}))", '"2.0" in row 0, which is no num'),
    ("say(json.dumps({'x': [[2.0], [None], [2]], 'mu': [[0.5]] * 3}))", "null in row 1"),
    ("say(json.dumps({'x': [[2.0], [True], [2]], 'mu': [[0.5]] * 3}))", "true in row 1"),
    ("say(json.dumps({'x': [[2.0], [2.0], [float('nan')]], 'mu': [[0.5]] * 3}))",
     "not finite in row 2 of 'x'"),
    ("say('{\"x\": [[2.0], [1e999], [2]], \"mu\": [[0.5], [0.5], [0.5]]}')", "not finite in row 1"),
    ("say(json.dumps({'x': [[2.0], [10**400], [2]], 'mu': [[0.5]] * 3}))", "not finite in row 1"),
    ("say('{\"x\": [[' + '9' * 5000 + ']]}')", "where an answer is due"),
    ("say(json.dumps({'error': 'no such scene.'}))", "4 steps of pendulum: no such scene.$"),
    ("say(json.dumps({'error': None}))", "without words"),
])  # fmt: skip
def test_what_goes_wrong_is_a_sentence(made, body, words):
    with pytest.raises(ProgramFailure, match=words) as caught:
        run(made(body))
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 600


def test_what_is_printed_first_or_beside_answers_is_a_sentence(made):
    with pytest.raises(ProgramFailure, match=r"printed 'Hello' (at its start|where an answer)"):
        run(made("say(json.dumps(rows(asked)))", "say('Hello')"))
    program = made("say(json.dumps(rows(asked)) + '\\n' + 'done')")
    run(program)
    with pytest.raises(ProgramFailure, match="printed 'done' after its answer"):
        run(program)


def test_silence_and_slowness_have_their_time(made):
    begun = time.monotonic()
    with pytest.raises(ProgramFailure, match=r"no answer within 0.5 s.*seconds=5\).*: begun$"):
        run(made("loud('begun'); time.sleep(60)", seconds=0.5))
    with pytest.raises(ProgramFailure, match="no answer within"):  # it never reads
        run(made("pass", "time.sleep(60)", seconds=0.5), x=[0.1] * 50_000)
    assert time.monotonic() - begun < 5


def test_much_on_standard_error_blocks_nothing(made):
    program = made("loud('x' * 999_999)\nsay(json.dumps(rows(asked)))")
    for _ in range(3):
        assert run(program, x=[0.1] * 50_000)[0].shape == (3, 50_000)


def test_a_crash_ends_a_run_and_the_next_one_starts_it_anew(made, tmp_path):
    count = tmp_path / "starts"
    first = f"open({str(count)!r}, 'a').write('x')"
    bad = "say(json.dumps(rows(asked))) if asked['scene'] == 'kepler' else sys.exit(1)"
    program = made(bad, first, restarts=2)
    for _ in range(6):
        with pytest.raises(ProgramFailure, match="exit code 1"):
            run(program)
        run(program, scene="kepler")
    assert len(count.read_text()) == 4  # three for the pendulum, and the last for kepler
    with pytest.raises(ProgramFailure):
        run(made("sys.exit(1)", restarts=0))


def test_an_error_leaves_it_running(made):
    program = made("n += 1\nsay(json.dumps({'error': str(n)}))", "n = 0")
    for n in (1, 2, 3):
        with pytest.raises(ProgramFailure, match=f": {n}.$"):
            run(program)


def test_another_process_starts_its_own(made):
    program = made("say(json.dumps(rows(asked)))")
    run(program)
    other = pickle.loads(pickle.dumps(program))
    assert other._process is None and other.digest == program.digest
    run(other)
    assert other._process.program.pid != program._process.program.pid
    other.close()


@pytest.mark.parametrize("word", ["{}", "--table={}", "exec cat '{}' | sort"])
def test_a_file_within_a_word_of_a_command_is_a_part_of_its_digest(word, tmp_path):
    (tmp_path / "forces.csv").write_text("1")
    words = ["sh", "-c", word.format("forces.csv")]
    digests = {Program(words, tmp_path, 1, 0, ()).digest}
    (tmp_path / "forces.csv").write_text("2")
    assert len(digests | {Program(words, tmp_path, 1, 0, ()).digest}) == 2


def test_a_changed_program_has_another_digest(made):
    before = made("say(1)").digest
    assert made("say(1)").digest == before != made("say(2)").digest


#: a command of a user's that is at a run when it ends; the program has a child of its own
USER = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it in the background
from pathlib import Path
import numpy as np
from discmech.integrators.extensions.foreign.program import Program
program = Program([sys.executable, "-S", "code.py"], Path(sys.argv[1]))
def run(scene):
    program.run(np.ones(1), np.ones(1), 0.1, 1, 1, scene, {})
run("pendulum")
print("ready", flush=True)
"""
BUSY = """
import subprocess
child = subprocess.Popen(["sleep", "300"])
open("pids", "w").write(f"{os.getpid()} {child.pid}")
"""


@pytest.mark.slow
@pytest.mark.parametrize("end", ["exit", "error", "interrupt", "kill", "terminate"])
def test_no_process_is_left(made, tmp_path, end):
    made("time.sleep(300) if asked['scene'] == 'kepler' else say(json.dumps(rows(asked)))", BUSY)
    last = {"exit": "", "error": "1 / 0"}.get(end, "run('kepler')")
    user = subprocess.Popen([sys.executable, "-c", USER + last, str(tmp_path)], text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)  # fmt: skip
    assert user.stdout.readline() == "ready\n"
    signals = {"interrupt": signal.SIGINT, "kill": signal.SIGKILL, "terminate": signal.SIGTERM}
    if end in signals:
        time.sleep(0.2)
        user.send_signal(signals[end])
    user.communicate(timeout=20)
    pids = [int(pid) for pid in Path(tmp_path, "pids").read_text().split()]
    until = time.monotonic() + 5
    while any(map(alive, pids)) and time.monotonic() < until:
        time.sleep(0.02)
    assert not any(map(alive, pids))


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize(("command", "more", "words"), [
    ("./my-code --json", {}, "give the command as a list"),
    ([], {}, "as a list"), (["./a", 3], {}, "3 is no word"), (["a\0b"], {}, "no word"),
    (["./none"], {}, "there is no program .*none: build it first"),
    (["no-such-program-here"], {}, "on the PATH: install it"),
    (["plain"], {}, "write ./plain"), (["./folder"], {}, "is a folder"),
    (["./plain"], {}, "chmod"), (["sh"], {"seconds": 0}, "no time"),
    (["sh"], {"seconds": "1"}, "no time"), (["sh"], {"restarts": -1}, "no count"),
])  # fmt: skip
def test_what_cannot_be_run_is_told_at_once(tmp_path, command, more, words):
    tmp_path.joinpath("folder").mkdir()
    tmp_path.joinpath("plain").write_text("nothing")
    with pytest.raises(BadInput, match=words):
        Program(command, tmp_path, **more)


def test_what_the_system_cannot_start_is_a_sentence(tmp_path):
    tmp_path.joinpath("odd").write_bytes(b"\x7fELF but no more")
    tmp_path.joinpath("odd").chmod(0o755)
    with pytest.raises(ProgramFailure, match=r"cannot be started .*interpreter first"):
        run(Program(["./odd"], tmp_path))
