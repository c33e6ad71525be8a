"""Canonical words to motion and poses."""
