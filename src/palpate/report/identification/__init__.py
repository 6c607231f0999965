"""An identification on paper: its page, its figure, its table on the terminal."""
