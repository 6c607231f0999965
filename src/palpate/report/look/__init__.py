"""How every page and every picture looks: colours by quantity, one frame, one kind of chart."""
