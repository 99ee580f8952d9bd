"""From results to pictures, tables and the report page; nothing is measured or judged here."""
