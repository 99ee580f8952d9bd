"""What a user's rule is asked: verify, compare, assertions for pytest."""
