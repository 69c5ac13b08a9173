"""The picture of a diagram: placed on a grid, routed, typeset and drawn as SVG."""
