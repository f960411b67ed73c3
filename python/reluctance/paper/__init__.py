"""The source paper, claim by claim: its drive simulated, its equations checked, one report.

A. D. Pierre et al., "Torque ripple minimization in switch reluctance motor using model predictive
control for water pumping application", CJAST 2019, doi 10.9734/CJAST/2019/44861 (CC BY 4.0).
"""

from reluctance.paper.claim import Claim
from reluctance.paper.report import Report, write
from reluctance.paper.study import Grid, Study

__all__ = ["Claim", "Grid", "Report", "Study", "write"]
