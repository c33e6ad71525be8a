"""The choice as figures and text."""
