"""Commands on contact problems: solved, exchanged, and the library of them."""
