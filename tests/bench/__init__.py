"""Studies of the bench itself: seeded faults, savings, the cost of digits, charts of one scene.

They are folders as those of `studies/` and commands as these; the wheel has them too.
"""
