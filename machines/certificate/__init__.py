"""Proofs over whole boxes that a platform on legs reaches, and is not singular; their files."""
