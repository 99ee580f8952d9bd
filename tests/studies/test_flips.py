"""A flipped bit in any kind of file is seen: rebuilt or refused, never believed.

By hand, 2,000 of each kind: DISCMECH_FLIPS=2000 pytest tests/studies/test_flips.py.
"""

import json
import os
import random

import numpy as np
import pytest

from discmech import BadInput, Scheme, midpoint
from discmech.integrators.compiler import Damaged, seal, unsealed
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.reference import ReferenceFailure
from discmech.reference.answer import store
from discmech.reference.answer.frozen import file_of

FLIPS = int(os.environ.get("DISCMECH_FLIPS", "60"))
SEED = int(os.environ.get("DISCMECH_SEED", "1"))


def flipped(path):
    """The file with one bit changed, again and again; then as it was."""
    content, chance = path.read_bytes(), random.Random(SEED)
    for _ in range(FLIPS):
        damaged, place = bytearray(content), chance.randrange(len(content))
        damaged[place] ^= 1 << chance.randrange(8)
        path.write_bytes(damaged)
        yield
    path.write_bytes(content)


@pytest.mark.parametrize("content", [
    "def advance(steps):\n    return steps\n", "\x7fELF machine code", json.dumps({"key": "k"}),
], ids=["text", "code", "result"])  # fmt: skip
def test_files_of_the_cache(tmp_path, content):
    path = tmp_path / "file"
    seal(path, content)
    for _ in flipped(path):
        with pytest.raises(Damaged):
            unsealed(path)
    assert unsealed(path) == content.encode()


def test_a_table_of_references(tmp_path):
    path = tmp_path / "harmonic.json"
    path.write_bytes(file_of("harmonic").read_bytes())
    right = store.read(path)
    for _ in flipped(path):
        try:
            assert store.read(path) == right  # a space between numbers is no part of them
        except ReferenceFailure:
            continue


@pytest.mark.dear(but=("run.npz]",))
@pytest.mark.parametrize("name", ["run.npz", "run.npz.x.npy", "run.npz.mu.npy"])
def test_a_checkpoint_and_its_rows(tmp_path, name):
    flow = Scheme(systems.fput(6), midpoint).flow("1/20")
    wanted = flow.trajectory(30, 10, checkpoint=tmp_path / "run.npz").x.copy()
    for _ in flipped(tmp_path / name):
        try:
            found = flow.trajectory(30, 10, checkpoint=tmp_path / "run.npz").x
        except BadInput:
            continue
        assert np.array_equal(found, wanted)  # a byte that no array holds
