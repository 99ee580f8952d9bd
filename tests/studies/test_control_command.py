"""`discmech control`."""

import json

from discmech.studies.command.entry import main


def test_a_problem_is_solved_and_shown(capsys):
    assert (
        main(["control", "double-integrator", "--rule", "gauss-2", "--steps", "4", "--json", "-"])
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert abs(found["cost"] - 6) < 1e-13 and len(found["controls"]) == 4
    assert main(["control", "double-integrator"]) == 0
    assert "cost 6.0006" in capsys.readouterr().out


def test_problems_are_listed_and_unknown_ones_refused(capsys):
    assert main(["control"]) == 0
    assert "upright-top" in capsys.readouterr().out
    assert main(["control", "upright-tip"]) == 2
    assert "did you mean upright-top?" in capsys.readouterr().err
