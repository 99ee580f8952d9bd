"""The table of what a system's features exclude."""

import pytest

from discmech.integrators import scenes
from discmech.integrators.scene.system import EXCLUSIONS, FEATURES


@pytest.mark.parametrize(("what", "features", "sentence"), EXCLUSIONS)
def test_every_row_names_features_and_makes_a_sentence(what, features, sentence):
    pendulum = scenes.get("pendulum")
    for feature in features:
        plain = feature.removeprefix("no ").removeprefix("a ")
        of = next(e for e in FEATURES if e.removeprefix("a ") == plain)
        assert bool(pendulum.has(of)) != bool(pendulum.has(f"no {plain}"))
    words = dict.fromkeys(("system", "groupoid", "what", "feature", "field", "own", "value"), "z")
    said = sentence.format(**words, rule="z")
    assert said.endswith(".") and "{" not in said
