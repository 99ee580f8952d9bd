"""The Lie algebras that are tested, built in and of one's own."""

from discmech.integrators import MatrixAlgebra, se, sl, so, sp, su


def heisenberg():
    """A user's own algebra: strictly upper triangular 3×3 matrices."""
    units = ((0, 1), (1, 2), (0, 2))
    return MatrixAlgebra(
        "heisenberg",
        tuple(tuple(tuple(int((i, j) == u) for j in range(3)) for i in range(3)) for u in units),
    )


def pair_of_so3():
    """so(3) ⊕ so(3) in blocks, the bases mixed: ideals that have to be found."""
    blocks = []
    for sign in (1, -1):
        for e in so(3).basis:
            top = [(*row, 0, 0, 0) for row in e]
            bottom = [(0, 0, 0, *(sign * 2 * v for v in row)) for row in e]
            blocks.append((*top, *bottom))
    return MatrixAlgebra("pair of so(3)", tuple(blocks))


ALGEBRAS = {
    a.name: a
    for a in (
        so(3), su(2), sl(2), se(2), se(3), so(4), heisenberg(), pair_of_so3(),
        sl(3), su(3), so(5), sp(4),
    )
}  # fmt: skip
