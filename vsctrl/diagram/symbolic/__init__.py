"""The loop equations solved in symbols: transfer functions, coefficients, compiled values."""
