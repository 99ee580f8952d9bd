"""Runs on disk: they go on where they were killed, to the same numbers."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from discmech import BadInput, Scheme, midpoint, trapezoidal
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.runs import checkpoint as module

STEPS, EVERY = 60, 10


@pytest.fixture(autouse=True)
def save_at_once(monkeypatch):
    monkeypatch.setattr(module, "SECONDS", 0)


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
