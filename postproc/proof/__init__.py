"""What is proved of a program: said in a line, kept in a file, compared with the files that `verify` is given."""
