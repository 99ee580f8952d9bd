"""What all studies share: what a study and a case are, running, remembering, looking up."""
