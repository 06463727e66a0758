"""An atlas of where each method fails: every failing case provoked, recognised and named."""
