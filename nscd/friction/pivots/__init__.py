"""Path following by pivots: how sliding islands are finished that sweeps do not."""
