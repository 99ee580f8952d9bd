"""What a flow has beside its runs is what is measured on a step that is one map."""

import pytest

from discmech import Scheme, midpoint, scenes
from discmech.integrators import BadInput
from discmech.integrators.flows import Flow, SceneRuns
from discmech.integrators.runs import OF_ONE_MAP


def public(kind):
    return {name for name in dir(kind) if not name.startswith("_")}


def test_a_flow_without_maps_refuses_all_that_is_of_maps():
    assert public(Flow) - public(SceneRuns) == OF_ONE_MAP
    flow = Scheme(scenes.get("bouncing-ball"), midpoint).flow("1/10")
    for name in OF_ONE_MAP:
        assert not hasattr(flow, name)
        with pytest.raises(BadInput, match=f"there is no {name}: bouncing-ball has contact"):
            getattr(flow, name)
