"""All rows: first the equations, then what the drive does."""

from reluctance.paper.claim import Claim
from reluctance.paper.claims_equations import equation_claims
from reluctance.paper.claims_results import result_claims
from reluctance.paper.study import Study


def claims(found: Study) -> list[Claim]:
    """Every claim of the paper that can be put to the model."""
    return equation_claims(found) + result_claims(found)
