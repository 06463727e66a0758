"""The error that is asked for, as people write it."""

from __future__ import annotations


def asked_error(text: str) -> float:
    """`5%`, `5 %` or `0.05` as a share. Raises ValueError for what is no number above 0 and below 1
    (100 %)."""
    number = text.strip()
    try:
        share = float(number[:-1]) / 100 if number.endswith("%") else float(number)
    except ValueError:
        share = float("nan")
    if not 0 < share < 1:
        raise ValueError(
            f"error: {text!r}; a share above 0 and below 1 is needed, such as 5% or 0.05"
        )
    return share
