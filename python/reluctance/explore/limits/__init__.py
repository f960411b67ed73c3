"""The physical limit at the operating point of a drive."""

from reluctance.explore.limits.point import check_point, operating_point
from reluctance.explore.limits.report import Limit, envelope_of, floor_of, limit

__all__ = ["Limit", "check_point", "envelope_of", "floor_of", "limit", "operating_point"]
