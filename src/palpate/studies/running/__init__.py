"""How a study is run: here or on a cluster, resumable at any moment."""
