"""Lattices: the law on patches, order in space, contact at sites, cost against N."""

from ..core.options import THOROUGH, control_option
from ..core.study import StudyFolder

#: faults to be caught: a step whose momenta shrink, a wrong sign, a step without the law
DAMPED, FLIPPED, RUNGE_KUTTA = "damped momenta", "flipped bracket", "classical Runge-Kutta"
CONTROL = control_option("a step", lambda: (DAMPED, FLIPPED, RUNGE_KUTTA))

STUDY = StudyFolder(
    name="lattices",
    package=__name__,
    claims=("order",),
    place=3.8,
    example=("fput", 2000),
    asks_for="sites",
    title="Lattices",
    summary="chains, nets and fields: the law on patches, order in space, contact, cost against N",
    asks="does a field keep its law on patches?",
    measured=(
        "what variations carry through the bonds of patches of space and time; the residual of a "
        "step; order in space of fields against closed forms; single steps of sites; laws of "
        "contact at sites; time and "
        "memory against N; the rest is measured by order, energy, momentum and symplecticity"
    ),
    judged=(
        "the law on patches to the limit of a form, order in space 2 and single steps of the "
        "rule's order to that of orders; a damped step, a flipped bracket and a Runge–Kutta step "
        "must be caught; not judged on time"
    ),
    about=(
        "A lattice is judged by what is linear in its sites: the derivative of a step is applied "
        "to random vectors, never written out. Of a field, what ω of a patch of sites gains in "
        "some steps has to be what its variations carry through the bonds at its rim: the "
        "multisymplectic law, to round-off. Order in time, energy, momenta and the Poisson form "
        "are in the studies of these names. It can mislead: random pairs see a defect of one site "
        "among many as a small one; times are of this machine, beside whatever else it did."
    ),
    alone=True,
    options=(CONTROL, THOROUGH),
)
