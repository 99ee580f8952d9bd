"""The presentation of results: wording, tables, figures, the page."""
