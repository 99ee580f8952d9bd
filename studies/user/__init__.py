"""Functions for the user's own rules: verify, compare, assertions for pytest."""
