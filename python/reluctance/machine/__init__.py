"""Magnetics of a phase, from a table, a drawing or a formula, and what a current can do at best.
Imports base."""
