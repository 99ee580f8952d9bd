"""Studies: each measures one property of a scheme and judges it; rendering is apart."""
