"""A rule with a slip, and what the bench says of it.

The weights 1/4 and 3/4 belong to the nodes 0 and 2/3 (Radau); here the second node is 1/2. It still
converges, is symplectic and keeps its momenta: only the order tells.
"""

from discmech import check, discretisation, show


@discretisation(order=2)
def radau_with_a_slip(L, G, x, u, h):
    return h * L(x, u) / 4 + 3 * h * L(G.target(x, u, h / 2), u) / 4


RULES = [radau_with_a_slip]


def main():
    return [
        check("order", scenes=["kepler"], rules=RULES, digits=[50], steps=64),
        check("symplecticity", scenes=["kepler"], rules=RULES, digits=[50], steps=8),
        check("momentum", scenes=["kepler"], rules=RULES, digits=[50], steps=50),
    ]


if __name__ == "__main__":
    for result in main():
        show(result)  # with the cause, where something fails
