"""The limits of the energy: of a run's error, of the modified energy, of the balance with work."""

from ..core.limits import Limit

LIMITS = {
    "slope": Limit(
        0.1, "share of the band that the slope of a run may explain",
        "set: half and double of it change none of 20 cases; a band that is all slope has 1",
    ),
    "wide": Limit(
        0.1, "share of the energy that moves, in a band that is wide",
        "set: above it a run is no longer near its motion; half and double change none of 20 cases",
    ),
    "steady": Limit(
        0.8, "way of a mean over the length of its path, where it goes one way",
        "set: a drift has 1, a walk less; 0.6 and 0.96 change none of 20 cases",
    ),
    "turns": Limit(
        4, "turns of a coordinate in a motion that has come back",
        "derived: two periods, each of which has two",
    ),
    "balance": Limit(
        16, "round-offs of a step by which energy less work may move",
        "derived: two energies of a few operations each",
    ),
    "stands": Limit(
        0.1, "share of the band by which a modified energy that stands may change",
        "set: half and double change none of 20 cases",
    ),
    "known": Limit(
        0.5, "share of the band to which the modified energy has to be known",
        "set: at half of it one of 20 cases is inconclusive, at double none changes",
    ),
    "elsewhere": Limit(
        3, "bands by which H̃ − H may change on a way that is looked at",
        "set: more shows something else than the run; half and double change none of 20 cases",
    ),
    "beyond": Limit(
        4, "times what another state, or another form, may explain",
        "set: it errs towards no drift; half and double change none of 20 cases",
    ),
    "many": Limit(
        8, "states of a certain drift, each farther than the one before",
        "set: by chance 1.1 % of walks do so with 4 states, 8·10⁻⁴ with 8, 7·10⁻⁶ with 16",
    ),
    "straight": Limit(
        0.1, "distance of the states of a certain drift from a line, over the last of them",
        "set: by chance 8·10⁻⁴ of walks of 8 states, 2·10⁻⁵ at half of it, 5·10⁻³ at double",
    ),
    "whole": Limit(
        1.0, "share of the energy that moves, in a band of a motion that is resolved",
        "derived: with a larger error all of the energy is another",
    ),
}  # fmt: skip
