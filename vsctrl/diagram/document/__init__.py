"""A loop as a file: formulas as text, units, blocks by their parameters, tables in and out."""
