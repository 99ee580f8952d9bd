"""A fault that two studies must see."""

from __future__ import annotations

import pytest
import sympy

from discmech.integrators.equations.arrows import Arrows


@pytest.fixture
def wrong_gain(tmp_path, monkeypatch):
    """Schemes whose μ′ − μ = F⁺ − F⁻ is off by a part in 10⁹, as by a wrong simplification."""
    right = Arrows.gain.func

    def gain(self):
        return right(self) * (1 + sympy.Rational(1, 10**9))

    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path / "kernels"))  # of no use to anybody else
    monkeypatch.setattr(Arrows, "gain", property(gain))
