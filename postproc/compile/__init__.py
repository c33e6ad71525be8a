"""Canonical program: words, feeds, commands, cycles."""
