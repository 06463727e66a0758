"""What the balance determines and what it leaves open: rank, determined contacts, intervals."""

from nscd.indeterminacy.determinacy import Determinacy, determinacy

__all__ = ["Determinacy", "determinacy"]
