"""Pictures of the choice of orientations; matplotlib is imported only where one is drawn."""
