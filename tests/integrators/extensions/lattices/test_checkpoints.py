"""Runs on disk: they go on where they were killed, to the same numbers."""

import os
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from discmech import BadInput, Scheme, midpoint, trapezoidal
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.runs import checkpoint as module

STEPS, EVERY = 60, 10
KILLED = """
import os
from discmech import Scheme, {rule}
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.runs import checkpoint
checkpoint.SECONDS = 0
Scheme({lattice}, {rule}).flow("1/20").trajectory(
    60, 10, checkpoint={path!r}, progress=lambda done: os._exit(9) if done == 30 else None)
"""


@pytest.fixture(autouse=True)
def save_at_once(monkeypatch):
    monkeypatch.setattr(module, "SECONDS", 0)


OTHERS = [("systems.fput(12)", trapezoidal), ("systems.membrane(5, 4)", midpoint)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lattice", "rule"),
    [("systems.rotors(12)", midpoint), *(pytest.param(*e, marks=pytest.mark.slow) for e in OTHERS)],
)
def test_a_killed_run_goes_on(tmp_path, lattice, rule):
    path = tmp_path / "run.npz"
    text = KILLED.format(lattice=lattice, rule=rule.name, path=str(path))
    assert subprocess.run([sys.executable, "-c", text], env=os.environ).returncode == 9
    done = []
    flow = Scheme(eval(lattice, {"systems": systems}), rule).flow("1/20")
    run = flow.trajectory(STEPS, EVERY, checkpoint=path, progress=done.append)
    assert done == [40, 50, 60]
    whole = flow.trajectory(STEPS, EVERY)
    for word in ("t", "x", "u", "mu"):
        assert np.array_equal(getattr(run, word), getattr(whole, word))
    assert isinstance(run.x, np.memmap)
    assert np.array_equal(np.load(f"{path}.x.npy"), whole.x)


@pytest.mark.slow
def test_checkpoints_of_other_runs_are_refused(tmp_path):
    path = tmp_path / "run.npz"
    scheme = Scheme(systems.fput(12), trapezoidal)
    scheme.flow("1/20").trajectory(STEPS, EVERY, checkpoint=path)
    other = Scheme(systems.fput(12, beta=1), trapezoidal)
    for run in (lambda: scheme.flow("1/40").trajectory(STEPS, EVERY, checkpoint=path),
                lambda: scheme.flow("1/20").trajectory(STEPS, 5, checkpoint=path),
                lambda: scheme.flow("1/20").trajectory(STEPS, EVERY, t0=1, checkpoint=path),
                lambda: scheme.flow("1/20").trajectory(
                    STEPS, EVERY, x0=np.ones((12, 1)), checkpoint=path),
                lambda: other.flow("1/20").trajectory(STEPS, EVERY, checkpoint=path),
                lambda: Scheme(systems.fput(12), midpoint).flow("1/20").trajectory(
                    STEPS, EVERY, checkpoint=path)):  # fmt: skip
        with pytest.raises(BadInput, match="checkpoint of another run"):
            run()


@pytest.mark.slow
def test_a_chain_is_not_gone_on_with_as_a_list_of_its_bonds(tmp_path):
    chain = replace(systems.fput(12), fixed_ends=False, fixed=[0, 11])
    for lattice, refused in ((chain, False), (replace(chain, bonds=chain.pairs), True)):
        flow = Scheme(lattice, midpoint).flow("1/20")
        with pytest.raises(BadInput, match="of another run") if refused else nullcontext():
            flow.trajectory(STEPS, EVERY, checkpoint=tmp_path / "run.npz")


def test_no_other_file_is_overwritten_by_rows(tmp_path):
    path, flow = tmp_path / "run.npz", Scheme(systems.fput(12), trapezoidal).flow("1/20")
    other = tmp_path / "run.npz.u.npy"
    other.write_text("mine")
    with pytest.raises(BadInput, match=r"would overwrite .*u\.npy"):
        flow.trajectory(STEPS, EVERY, checkpoint=path)
    assert [e.read_text() for e in tmp_path.iterdir()] == ["mine"]
    other.unlink()
    flow.trajectory(0, checkpoint=path)  # of a run without a step, too, there is a state
    assert flow.trajectory(0, checkpoint=path).x.shape == (1, 12, 1)


def test_damaged_checkpoints_are_refused(tmp_path):
    path, flow = tmp_path / "run.npz", Scheme(systems.fput(12), trapezoidal).flow("1/20")
    flow.trajectory(STEPS, EVERY, checkpoint=path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(BadInput, match="no checkpoint, or a damaged one"):
        flow.trajectory(STEPS, EVERY, checkpoint=path)
    path.write_bytes(content)
    rows = tmp_path / "run.npz.u.npy"
    whole = rows.read_bytes()
    for damaged in (whole[:-8], whole + b" ", whole[:60], b"", b"\0" + whole[1:]):
        rows.write_bytes(damaged)
        with pytest.raises(BadInput, match=r"u\.npy of the checkpoint are gone or damaged"):
            flow.trajectory(STEPS, EVERY, checkpoint=path)
        assert rows.read_bytes() == damaged
    for other in (np.zeros((7, 12, 1), np.float32), np.zeros((7, 6, 2))):
        np.save(rows, other)
        with pytest.raises(BadInput, match="gone or damaged"):
            flow.trajectory(STEPS, EVERY, checkpoint=path)
    rows.unlink()
    with pytest.raises(BadInput, match="gone or damaged"):
        flow.trajectory(STEPS, EVERY, checkpoint=path)
    with pytest.raises(BadInput, match="give the name of a file"):
        flow.trajectory(STEPS, EVERY, checkpoint=3)
    with pytest.raises(BadInput, match="is no name of a file"):
        flow.trajectory(4, checkpoint="a\0b")
    with pytest.raises(BadInput, match="there is no folder"):
        flow.trajectory(STEPS, EVERY, checkpoint=tmp_path / "none" / "run.npz")
