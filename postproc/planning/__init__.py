"""Passes as smooth joint paths, feeds within the limits."""
