"""Steps of a changed kernel in Python, and in machine code once they are many."""

import numpy as np
import pytest

from discmech.integrators import Scheme, rules
from discmech.studies.power import interpreted
from tests.objects import SCENES


@pytest.mark.parametrize("rule", ["trapezoidal", "midpoint"])
def test_machine_code_makes_the_steps_that_python_made(rule, monkeypatch):
    scheme, runs, compiled = Scheme(SCENES["heavy-top"], rules.get(rule)), [], []
    made = interpreted.compiled_text
    monkeypatch.setattr(
        interpreted, "compiled_text", lambda *given: compiled.append(1) or made(*given)
    )
    for worth in (100, 0):
        monkeypatch.setattr(interpreted, "WORTH", worth)
        changed = interpreted.InterpretedScheme(scheme, edit=lambda text: f"{text}\n# changed")
        runs.append(changed.flow("1/20").trajectory(30))
        assert bool(compiled) == (worth == 0)
    by_python, by_machine = runs
    # contracted products round once where Python's round twice: some round-offs a step
    bound = 30 * 100 * np.finfo(float).eps
    assert np.abs(by_python.x - by_machine.x).max() < bound
    assert np.abs(by_python.mu - by_machine.mu).max() < bound * np.abs(by_python.mu).max()
