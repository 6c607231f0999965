"""What a study is: its file, its parameters, and the plan of its runs."""
