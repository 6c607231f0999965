"""From a record to an Identification: contacts found, channels matched, models fitted and compared, verdicts given."""

from palpate.identification.causes import Code, Warn
from palpate.identification.pipeline import identify
from palpate.identification.pooling import Pooled, pool
from palpate.identification.result import Comparison, Identification
from palpate.identification.uncertainty import Parameter, Verdict

__all__ = [
    "Code",
    "Comparison",
    "Identification",
    "Parameter",
    "Pooled",
    "Verdict",
    "Warn",
    "identify",
    "pool",
]
