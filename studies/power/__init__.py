"""The power of the bench: faults that must be caught, and valid rules that must not be.

As in mutation testing, a fault is data: where (a rule's expression, a groupoid's map, a scheme's
equation, the solver), what (an operator) and a seed that chooses the place. Each goes through the
same studies as a user's rule.
"""
