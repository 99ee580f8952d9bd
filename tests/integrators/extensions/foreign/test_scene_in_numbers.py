"""The scene as a black box sees it."""

import pytest

from discmech import Scheme, black_box, scenes
from discmech.integrators import BadInput


def test_parameters_have_their_names_in_brackets_too():
    @black_box(order=1)
    def still(q, p, h, system):
        return q, p

    system = Scheme(scenes.get("pendulum"), still).flow("0.1").system
    name, value = next(iter(vars(system.parameters).items()))
    assert system.parameters[name] == getattr(system.parameters, name) == value
    with pytest.raises(BadInput, match='there is no parameter "stiffness": '):
        system.parameters["stiffness"]


@pytest.mark.parametrize("digits", [16, 30])
def test_the_time_goes_on_where_the_scene_does_not_depend_on_it(digits):
    """A program that changes with time of its own is seen by every run that is long enough."""
    times = []

    @black_box(order=1, numbers="any")
    def counted(q, p, h, system):
        times.append(float(system.t))
        return q + h * system.velocity(q, p), p - h * system.gradient(q, p)

    flow = Scheme(scenes.get("pendulum"), counted).flow("0.1", digits)
    flow.trajectory(4)
    flow.trajectory(2, t0="1/2")

    assert times == pytest.approx([0, 0.1, 0.2, 0.3, 0.5, 0.6])
