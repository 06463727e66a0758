"""Block Cholesky factors of the inertia with closed contacts."""
