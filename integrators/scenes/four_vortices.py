"""Four point vortices, whose motion is chaotic (Aref, Pomphrey 1982)."""

from ..groupoids import pair
from ..scene import Conserved, Parameters, Point, Scalar, Scene
from .vortex_pair import angular_impulse, hamiltonian, impulse


def one_form(x: Point, p: Parameters) -> list[Scalar]:
    """Σ Γ (y dx − x dy)/2, which turns with the plane."""
    return [
        e for i, g in enumerate(p.strengths)
        for e in (g * x[2 * i + 1] / 2, -g * x[2 * i] / 2)
    ]  # fmt: skip


scene = Scene(
    name="four-vortices",
    title="Four point vortices",
    groupoid=pair(8),
    parameters={"strengths": [1, 1, 1, 1]},
    one_form=one_form,
    hamiltonian=hamiltonian,
    x0=[1, 0, 0, "3/5", "-4/5", "-1/10", "1/5", "-7/10"],
    duration=20,
    step="1/50",
    symmetries=[Conserved("impulse", impulse, kind="first integral"),
                Conserved("angular impulse", angular_impulse, kind="first integral")],
    source="Aref, Pomphrey, Proc. R. Soc. London A 380 (1982), 359",
)  # fmt: skip
