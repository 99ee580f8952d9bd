"""The parts that all studies share: studies and cases, running, remembering, looking up."""
