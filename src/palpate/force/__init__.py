"""Force control that certifies itself: gains, the proof of where they are stable, and a law that stays inside."""
