"""What two programs do differently: paths, feeds, states; not how they are written."""
