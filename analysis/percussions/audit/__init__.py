"""A judge of contact forces: whether they are what the momentum of their bodies needs."""

from analysis.percussions.audit.judge import Audit, audit

__all__ = ["Audit", "audit"]
