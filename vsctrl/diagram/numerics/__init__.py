"""Chebyshev polynomials and graphs: tables and searches that several rooms need."""
