"""From a record to an Identification: contacts found, channels matched, models fitted and compared, verdicts given."""

from __future__ import annotations

from palpate.identification.codes import Code, Warn
from palpate.identification.identifying import identify
from palpate.identification.result import Comparison, Identification, Parameter, Verdict

__all__ = ["Code", "Comparison", "Identification", "Parameter", "Verdict", "Warn", "identify"]
