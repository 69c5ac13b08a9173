"""The catalogue of visual features, each declared and derived."""
