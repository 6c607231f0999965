"""A judge of `palpate.identify` that shares nothing with the project's bench: its own contact, sensors and scorer."""
