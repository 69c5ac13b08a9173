"""Estimators: pose and depth from images, filtered image points."""
