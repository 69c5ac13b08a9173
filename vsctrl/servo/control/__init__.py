"""What the computer does: from images to the twist that it asks for."""
