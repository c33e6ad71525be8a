"""Joints of whole programs: branches, windings, rewinds, singular directions."""
