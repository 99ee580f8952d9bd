"""The paper, sections 2 and 3, equation by equation: one table, checked and printed as PAPER.md."""
