"""Reading a program back, second witness, errors that are left."""
