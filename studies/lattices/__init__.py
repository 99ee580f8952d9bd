"""Lattices: order in time and space, long runs, Ω and its law on patches, cost against N."""

from ..core.options import THOROUGH, control_option
from ..core.study import StudyFolder

#: what has to be caught: a step whose momenta shrink, a wrong sign, a step without the law
DAMPED, FLIPPED, RUNGE_KUTTA = "damped momenta", "flipped bracket", "classical Runge-Kutta"
CONTROL = control_option("a step", lambda: (DAMPED, FLIPPED, RUNGE_KUTTA))

STUDY = StudyFolder(
    name="lattices",
    package=__name__,
    place=3.8,
    title="Lattices",
    summary="chains, nets and fields: order, long runs, Ω, the law on patches, cost against N",
    asks="is a field or chain integrated rightly?",
    measured=(
        "order in time and, of fields, in space, against closed forms or the equations of motion; "
        "energy and momenta over long runs; constraints on bonds; the Poisson form on random "
        "pairs; what variations carry through the bonds of patches of space and time; laws of "
        "contact; time and memory against N"
    ),
    judged=(
        "orders ±0.05; energy and momenta as of scenes; forms and the law on patches ≤ 1e-13; a "
        "damped step, a flipped bracket and a Runge–Kutta step must be caught; not judged on time"
    ),
    about=(
        "A lattice is judged by what is linear in its sites: the derivative of a step is applied "
        "to random vectors, never written out. Of a field, what ω of a patch of sites gains in "
        "some steps has to be what its variations carry through the bonds at its rim: the "
        "multisymplectic law, to round-off. It can mislead: random pairs see a defect of one site "
        "among many as a small one; times are of this machine, beside whatever else it did."
    ),
    alone=True,
    options=(CONTROL, THOROUGH),
)
