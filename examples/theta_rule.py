"""A rule with a parameter: the Lagrangian at the fraction θ of a step.

Of order 1 for every θ but 1/2, where it is the midpoint rule and of order 2.
"""

from sympy import Rational

from discmech import check, discretisation, show


def theta_rule(theta, order):
    @discretisation(order=order, name=f"theta-{theta.p}-{theta.q}")
    def rule(L, G, x, u, h):
        return h * L(G.target(x, u, theta * h), u)

    return rule


RULES = [theta_rule(Rational(1, 3), 1), theta_rule(Rational(1, 2), 2)]


def main():
    return check("order", scenes=["pendulum", "heavy-top"], rules=RULES, digits=[50], steps=32)


if __name__ == "__main__":
    show(main())
