"""A fault that two studies must see."""

import pytest
import sympy

from discmech.integrators.equations.arrows import Arrows


@pytest.fixture
def wrong_gain(tmp_path, monkeypatch):
    """Schemes whose μ′ − μ = F⁺ − F⁻ is off by a part in 10⁹, as by a wrong simplification."""

    def gain(self):
        wrong = self.gain * (1 + sympy.Rational(1, 10**9))
        return self._per_step(self.of.graph.column(wrong))

    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path / "kernels"))  # of no use to anybody else
    monkeypatch.setattr(Arrows, "gain_of_rows", property(gain))
