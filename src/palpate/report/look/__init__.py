"""Look of all pages and pictures: colours by quantity, one frame, one kind of chart."""
