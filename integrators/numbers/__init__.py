"""Numbers: exact input, double and any precision, and functions made of symbolic expressions."""
