"""What stands under the figures of a report."""

from __future__ import annotations

CONVERGENCE = (
    "Error in (x, μ) at the end of the run against step size; the number beside a rule is the "
    "fitted order. Filled marks are in the fit. Hollow marks are left out because the error is "
    "not yet asymptotic there, crosses because round-off has taken over; a bar on the upper edge "
    "is a run that failed. The triangles show the slopes that are expected. Where curves coincide "
    "the line has the colours of all of them in turn and the marks lie within one another."
)
DEFECTS = (
    "Defect of the symplectic form under the pullback by the step (filled), and of the Poisson "
    "bracket under the map on the dual (hollow). A mark is the worst point of the trajectory, the "
    "line beside it goes to the median; zero is drawn at the left edge. Dashed: the limit that the "
    "verdict uses. Dotted: one unit of round-off."
)
CONTROLS = (
    "Controls: maps that are not symplectic, or are tested against a wrong bracket, and have to "
    "be caught above the upper dashed line. Where a Runge–Kutta method is followed to small steps "
    "its defect sinks below the limit of a sound scheme and into round-off (grey band): there it "
    "cannot be told from a symplectic one, so a verdict at small steps alone would prove nothing. "
    "Grey dots: the sound schemes of the scene."
)
REVERSIBILITY = (
    "How far a step back, Φ₋ₕ, misses the point that the step forth, Φₕ, has left, relative to the "
    "size of the state. Dashed: the limit that the verdict uses. Dotted: one unit of round-off."
)
DRIFT = (
    "Drift of each momentum map, relative to the sum of the absolute values of its terms, against "
    "the number of steps (the worst in each of many bins); beside a rule the worst of the whole "
    "run. Dotted: the random walk that round-off alone makes, ε√N. A line that rises faster than "
    "it is a systematic drift. Zero is drawn on the lower axis; a line in several colours is "
    "several curves that coincide."
)
ENERGY = (
    "Relative energy error against time: one strip a rule, each from its own smallest to its own "
    "largest error, which stand on its left; dashed: zero. Of a long run the space between the "
    "smallest and the largest error of each short stretch is filled. A sound variational "
    "integrator fills a band that neither tilts nor widens; where the energy is kept exactly only "
    "the drift of round-off is left, and the band is a line."
)

WORK = (
    "Error against run time: the median of interleaved rounds, with its quartiles as a bar; hollow "
    "marks had outliers among their samples, which are kept. Rules of this bench have full lines, "
    "other people's integrators dashed ones. A line ends where the error no longer sinks or where "
    "the next run would exceed the budget. Dashed across: the error that rounding the start to "
    "double precision alone makes, the floor for everybody."
)
LONG_WORK = (
    "The same over many characteristic periods, where the energy is what counts: a method that "
    "is not symplectic pays for time as well as for accuracy."
)

LINEAR = (
    "The exact step of each rule on the harmonic oscillator. Left: its spectral radius; a "
    "symplectic step is stable while it is one, to the number beside the rule (by root "
    "finding), and controls leave the circle at once. Right: the phase of a step while it is "
    "stable, beside the exact one (dotted); where it is a third or a quarter of a turn, "
    "nonlinear terms may resonate."
)
MAPS = (
    "What becomes of runs at each step size (across, times the fastest frequency) and each "
    "stiffness (upwards). Bounded: none of the others. Resonant: the energy band is over four "
    "times that at both neighbouring steps. Drifting: the energy's mean moves by more than half "
    "its band and a hundredth of its terms, also in a run eight times as long. Escaped: x leaves "
    "the region of the true motion by ten times its size. Newton failed: the equations of a step "
    "were not solved. Blown up: the energy error exceeds the energy's terms at the start, or the "
    "numbers are no longer finite."
)
SPRINGS = (
    "Fermi–Pasta–Ulam chain. Left: how far the energies of the three stiff springs, as running "
    "means, are from their true exchange; a run may be stable and still hand the energy on at "
    "the wrong pace. Middle: the same for stiffer springs, which take longer. Right: how far the "
    "springs' whole energy, an adiabatic invariant, moves over long times at a step of ten fast "
    "radians; dashed: 15 %. imex keeps it from ω = 100 on."
)
CHARTS = (
    "Runs from first steps of 0.01 to 0.99 of a turn about six axes. On the group the step makes "
    "the rotation that is asked for; the method that is bound to one Cayley chart, started with "
    "the same spin, makes another one (dots), since no u has half a turn (dotted: τ(hu) of the "
    "spin itself). The ball: starts (points), the translate that holds each rotation best (tints: "
    "e, or the axis of a half-turn), half a turn (dotted), and the lines on which FL is singular."
)
COSTS = (
    "Processor seconds of a reference whose digits are proven, against the digits and against the "
    "time. Dotted: the slope over the upper half of the points."
)
