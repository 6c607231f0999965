"""Troubles of the laws in a press or a slide: shown when they begin; one that lasts ends it."""

from collections import Counter
from collections.abc import Callable

from palpate.force.guard import BEYOND, DRIFTS, LATE, SWINGS, TROUBLES
from palpate.force.sliding import slide_state

_SLIDES = (
    slide_state.REFUTED,
    slide_state.STEPPED,
    slide_state.JERKS,
    slide_state.LOST,
    slide_state.AWAY,
)
BORNE = {slide_state.SLIDING_TROUBLES[code] for code in (LATE, DRIFTS, BEYOND, SWINGS, *_SLIDES)}
"""Troubles that never end a press or a slide."""


class Troubles:
    """Troubles of the law: each is shown when it begins, and one that lasts longer than the lag ends the press.

    Those of `BORNE` never end it. Missed ticks are not shown: the wire counts them, and ends the press at too many.

    Args:
        lag: of the loop [s].
        show: called with the sentence of a trouble.
    """

    def __init__(self, lag: float, show: Callable[[str], None]):
        self._lag, self._show = lag, show
        self._now, self._since = "", 0.0
        self.ticks: Counter[str] = Counter()

    def lasting(self, trouble: str, time: float) -> str | None:
        """The sentence of a trouble that has lasted too long; None of none.

        Args:
            trouble: of this tick, empty for none.
            time: by the clock of the arm [s].
        """
        trouble = "" if trouble == TROUBLES[LATE] else trouble
        if trouble != self._now:
            self._now, self._since = trouble, time
        if not trouble:
            return None
        if trouble not in self.ticks:
            self._show(trouble)
        self.ticks[trouble] += 1
        return trouble if time - self._since > self._lag and trouble not in BORNE else None
