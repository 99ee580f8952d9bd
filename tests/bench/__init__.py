"""Studies of the bench itself: seeded faults, what skipped work saves, what proven digits cost.

They are folders as those of `studies/` and commands as these; the wheel has them too.
"""
