"""First-order geometry of a step: TΨ, the prolongation, defects, transitions between arrows."""
