"""An action of one's own: SL(2) on the line by fractional linear maps, a particle on an orbit.

A right action is a map (x, g) ↦ x·g with x·e = x and (x·g)·g′ = x·(gg′); both are checked when the
first scheme is built, and a wrong one is refused with the law that fails.
"""

from discmech import BadInput, Scene, Scheme, action, check, midpoint, show, sl


def moebius(x, g):
    return [(x[0] * g[0, 0] + g[1, 0]) / (x[0] * g[0, 1] + g[1, 1])]


def from_the_left(x, g):
    return [(g[0, 0] * x[0] + g[0, 1]) / (g[1, 0] * x[0] + g[1, 1])]


def particle(right_action):
    return Scene(
        name="particle-on-an-orbit",
        groupoid=action(sl(2), right_action=right_action, dim_x=1),
        lagrangian=lambda x, v, p: v.dot(v) / 2 - x[0] ** 2 / 2,
        x0=["0.3"],
        v0=["0.2", "-0.1", "0.4"],
        duration=2,
        step="0.02",
    )


def main():
    try:
        Scheme(particle(from_the_left), midpoint)
    except BadInput as refusal:
        said = str(refusal)
    return check(
        "order", scenes=[particle(moebius)], rules=["midpoint"], digits=[50], steps=32
    ), said


if __name__ == "__main__":
    result, refusal = main()
    show(result)
    print(refusal)
