"""A bench of one direction: any arm of `palpate.force` presses along a line with the cautious law."""
