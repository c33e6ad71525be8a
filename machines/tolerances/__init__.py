"""What the errors of each dimension do to the tool, and which dimension to tighten."""
