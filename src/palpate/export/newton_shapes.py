"""Newton's contact: two shapes share the mean of their ke and kd, so both get K and B.

The law of SolverSemiImplicit and SolverFeatherstone (newton 1.8): f = ke d + kd max(d', 0), d the penetration: the
damper works going in only. SolverMuJoCo takes ke and kd for a constraint of its own, and wants the rule of MuJoCo.
"""

from __future__ import annotations

from palpate.export.contact import Contact

_SOLVERS = (
    "for SolverSemiImplicit and SolverFeatherstone; SolverMuJoCo takes the same numbers for another contact: export a"
    " scene of MuJoCo for it"
)
NOTES = (
    _SOLVERS,
    "the damper acts in loading only: in unloading, Newton's force is K x",
    "both shapes must have these numbers: Newton takes the mean of the two",
)

_TEXT = '''"""Contact of a surface for Newton: call apply(builder, surface, probe) before builder.finalize()."""

KE = {stiffness:.17g}  # N/m
KD = {damping:.17g}  # N s/m, in loading only


def apply(builder, *shapes):
    """Give shapes of a newton.ModelBuilder this contact; Newton takes the mean of the two that touch."""
    for shape in shapes:
        builder.shape_material_ke[shape] = KE
        builder.shape_material_kd[shape] = KD
'''


def python(contact: Contact) -> str:
    """A module that gives shapes the contact."""
    return _TEXT.format(stiffness=contact.stiffness.value, damping=contact.damping.value)
