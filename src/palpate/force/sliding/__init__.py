"""Force control while the tip moves along an unknown curved surface: normal, friction and stiffness estimated."""
