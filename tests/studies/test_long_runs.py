"""What several studies ask for is computed once, and is what each would have computed."""

import numpy as np

from discmech.integrators import Scheme, scenes
from discmech.integrators.rules import midpoint
from discmech.studies.core.case import Case, silent
from discmech.studies.systems.runs import long_run


def test_the_run_that_was_made_last_is_there_once():
    case = Case("momentum", scenes.get("kepler"), midpoint, 16)
    first = long_run(case, case.scheme, 100, silent)
    assert long_run(case, case.scheme, 100, silent) is first
    again = long_run(case, case.scheme, 100, silent)
    assert again is not first and np.array_equal(again.mu, first.mu)
    assert len(long_run(case, case.scheme, 99, silent).t) == 100


def test_a_scene_has_one_form_with_the_attitude_as_base():
    body = scenes.get("rigid-body")
    assert body.with_attitude() is body.with_attitude()
    other = body.with_values(v0=[0, 0, 1])
    assert other.with_attitude().v0 == other.v0 != body.with_attitude().v0


def test_maps_at_hand_are_those_of_their_point():
    flow = Scheme(scenes.get("heavy-top"), midpoint).flow("1/10", digits=30)
    geometry, x, u = flow.geometry, [0, 0, 1], [1, 2, 3]
    with flow.numbers.working():
        points = [flow.context.vectors(x, [a * e for e in u]) for a in range(1, 12)]
        found = [geometry.at(*point)["plus"] for point in points]
        assert all((geometry.at(*p)["plus"] == f).all() for p, f in zip(points, found, strict=True))
        changed = geometry.at(*points[0])
        changed.clear()
        assert geometry.at(*points[0])
