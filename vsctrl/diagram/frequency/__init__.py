"""The exact frequency response: values, crossings, peaks, margins."""
