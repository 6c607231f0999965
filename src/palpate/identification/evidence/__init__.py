"""Evidence without a model: dynamic stiffness, the press, the stiffness at the working point."""

from palpate.identification.evidence.press import evidence_of, stiffness_of

__all__ = ["evidence_of", "stiffness_of"]
