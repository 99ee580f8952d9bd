"""A group of one's own: rigid motions of the plane and dilations, from a basis of its algebra.

L, R, structure constants and the references follow from the matrices. The Cayley transform does
not map this algebra into its group, so the exponential is taken.
"""

from discmech import MatrixAlgebra, Scene, check, exponential, lie_group, show

similarity = MatrixAlgebra(
    "sim(2)",
    (
        ((0, -1, 0), (1, 0, 0), (0, 0, 0)),  # turn
        ((1, 0, 0), (0, 1, 0), (0, 0, 0)),  # dilate
        ((0, 0, 1), (0, 0, 0), (0, 0, 0)),  # shift along the first axis
        ((0, 0, 0), (0, 0, 1), (0, 0, 0)),  # and along the second
    ),
)

scene = Scene(
    name="free-similarity",
    groupoid=lie_group(similarity, exponential),
    parameters={"inertia": [3, 2, 1, 1]},
    lagrangian=lambda x, v, p: sum(p.inertia[i] * v[i] ** 2 for i in range(4)) / 2,
    v0=["0.5", "0.2", "0.3", "-0.4"],
    duration=4,
    step="0.05",
)


def main():
    return check("order", scenes=[scene], rules=["midpoint"], digits=[50], steps=16)


if __name__ == "__main__":
    show(main())
