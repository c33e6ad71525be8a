"""Blocks in joints: links, points between, travel, reach."""
