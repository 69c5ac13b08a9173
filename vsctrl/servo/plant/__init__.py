"""What nature does: the lens, the target, the robot that carries the camera."""
