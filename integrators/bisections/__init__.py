"""Section 4 of the paper: bisections, translations, the general evolution operator, covers."""
