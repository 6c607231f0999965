"""Identify what a probe touched, from a record of its position and force."""

from palpate.identification.causes import Code, Warn
from palpate.identification.indenter import Indenter, with_modulus
from palpate.identification.pipeline import identify
from palpate.identification.pooling import Pooled, pool
from palpate.identification.result import Comparison, Identification
from palpate.identification.uncertainty import Parameter, Verdict

__all__ = [
    "Code",
    "Comparison",
    "Identification",
    "Indenter",
    "Parameter",
    "Pooled",
    "Verdict",
    "Warn",
    "identify",
    "pool",
    "with_modulus",
]
