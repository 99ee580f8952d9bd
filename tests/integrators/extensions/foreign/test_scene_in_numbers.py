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
