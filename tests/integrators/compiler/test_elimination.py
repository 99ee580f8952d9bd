"""The loop that solves large systems: one text for compiled doubles and for exact numbers."""

import random
import textwrap
import threading
from fractions import Fraction

import numpy as np
import pytest

from discmech.integrators.compiler.llvm_values import Array
from discmech.integrators.compiler.machine_code import compiled
from discmech.integrators.compiler.module_text import driver_text
from discmech.integrators.numbers import run_text


def system(m, zeros):
    """m equations in fractions, with zeros on the diagonal where rows must be exchanged."""
    chance = random.Random(m)
    rows = [[Fraction(chance.randint(-50, 50), 16) for _ in range(m)] for _ in range(m)]
    for i in range(zeros):
        rows[i][i] = Fraction(0)
    solution = [Fraction(chance.randint(-9, 9), 4) for _ in range(m)]
    right = [sum(a * b for a, b in zip(row, solution, strict=True)) for row in rows]
    return [[*row, e] for row, e in zip(rows, right, strict=True)], solution


@pytest.mark.parametrize(("m", "zeros"), [(1, 0), (2, 2), (13, 0), (13, 5), (27, 27)])
def test_the_loop_solves(m, zeros):
    rows, solution = system(m, zeros)
    a = np.array([[float(e) for e in row] for row in rows])
    text = driver_text()
    text = text[text.index("@node") :]
    text += "\n\ndef advance(a, m):\n    eliminate(a, m)\n    return 0, 0\n"
    names = run_text(text, {})
    compiled("test", text, names, {"a": Array("f", columns=m + 1)})(a, m)
    size = np.linalg.cond(np.array([[float(e) for e in row[:m]] for row in rows]))
    assert np.allclose(a[:, m], [float(e) for e in solution], rtol=0, atol=1e-14 * size)
    names["eliminate"](rows, m)
    assert [row[m] for row in rows] == solution


def test_a_large_matrix_is_not_on_the_stack():
    """192 unknowns take 296 kB; a thread may have 128 KiB of stack."""
    m = 192
    text = driver_text()
    text = text[text.index("@node") :] + textwrap.dedent(f"""
        def advance(b):
            a = zeros({m}, {m + 1})
            for i in range({m}):
                a[i][i] = 2.0
                if i > 0:
                    a[i][i - 1] = 1.0
                a[i][{m}] = b[i]
            eliminate(a, {m})
            for i in range({m}):
                b[i] = a[i][{m}]
            return 0, 0
        """)
    b = np.full(m, 3.0)
    b[0] = 2
    solve = compiled("test", text, run_text(text, {}), {"b": Array("f")})
    before = threading.stack_size(2**17)
    try:
        threads = [threading.Thread(target=solve, args=(given,)) for given in (b, b.copy())]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        threading.stack_size(before)
    assert np.array_equal(b, np.ones(m))
