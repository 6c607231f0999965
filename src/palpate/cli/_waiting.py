"""What the user is told when a loop has to be compiled first."""

COMPILING = "compiling the loop: some ten seconds, once after installation"
