"""How results are shown: wording, tables, figures, the page."""
