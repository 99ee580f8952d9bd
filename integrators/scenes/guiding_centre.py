"""The guiding centre in a magnetic mirror by coordinates of its field, (ψ, φ, χ, u).

A vacuum field is B = ∇ψ × ∇φ = ∇χ, so A = ψ∇φ and b = ∇χ/B: half of ϑ = ψ dφ + (u/B) dχ vanishes,
as degenerate variational integrators need it. Round an axis with the strength β(χ) the potential is
χ = F(z) − r²F″/4 + …, F′ = β(F), and the flux ψ = r²F′/2 − …; so B = β − ψ (ββ″/2 − β′²/4) + O(ψ²),
which is 1 + χ² − ψ for β = 1 + χ².
"""

from ..groupoids import pair
from ..scene import Conserved, Parameters, Point, Scalar, Scene


def _strength(x: Point) -> Scalar:
    return 1 + x[2] ** 2 - x[0]


def one_form(x: Point, p: Parameters) -> list[Scalar]:
    """ψ along φ, u/B along χ."""
    return [0, x[0], x[3] / _strength(x), 0]


def hamiltonian(x: Point, p: Parameters) -> Scalar:
    """u²/2 + mB, m the magnetic moment."""
    return x[3] ** 2 / 2 + p.moment * _strength(x)


scene = Scene(
    name="guiding-centre",
    title="The guiding centre by coordinates of the field",
    groupoid=pair(4),
    parameters={"moment": "1/10"},
    one_form=one_form,
    hamiltonian=hamiltonian,
    x0=["1/10", 0, 0, "1/4"],
    duration=20,
    step="1/10",
    symmetries=[Conserved("flux", lambda x, mu, p: mu[1])],
    source="Ellison, Finn, Burby, Kraus, Qin, Tang, Phys. Plasmas 25 (2018), 052502; Cary, "
    "Brizard, Rev. Mod. Phys. 81 (2009), 693",
)
