"""What the cutter must do, in the part's frame: CL files in, arrays out."""
