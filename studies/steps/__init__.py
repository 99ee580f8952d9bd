"""Rules whose steps vary: order at the times reached, the way back, the extended form, energy."""

from ..core.options import control_option
from ..core.study import StudyFolder
from .limits import LIMITS

STUDY = StudyFolder(
    name="steps",
    package=__name__,
    limits=LIMITS,
    place=3.2,
    example=("kepler", 500),
    title="Steps that vary",
    summary="rules whose steps vary: order at the times reached, way back, extended form, energy",
    claims=("order", "symplectic", "reversible", "energy", "energy band"),
    asks="do steps that vary keep the order, form and way back of the rule?",
    measured=(
        "error in (x, μ) at the physical times that are reached, on a ladder of ε at 50 digits; a "
        "run and back in all that the steps have; by Poincaré the form dμ∧dx + dp_t∧dt of one "
        "step; band and drift of the energy over 5·10⁴ steps or more"
    ),
    judged=(
        "slope within ±{order} of the base's order; back to {back}, and the form to {form}, "
        "where they are kept; by Poincaré the energy as in its own study; the naive step must be "
        "caught"
    ),
    about=(
        "A rule whose steps follow the motion is judged in physical time: its error is measured "
        "at the times that its rows have. By Poincaré's transformation a step keeps a form on the "
        "extended phase space; a reversible step keeps none, but is undone by a step of −ε. The "
        "naive step, which the present state alone decides, has the order of its rule and loses "
        "all else, so it is the control that must be caught. It can mislead: a σ that hardly "
        "varies makes the naive step as good as any."
    ),
    options=(control_option("a step", lambda: ("naive step",)),),
)
