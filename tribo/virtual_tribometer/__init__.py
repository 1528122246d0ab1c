"""A machine that measures a known world: pulls of given friction, exported as a machine would export them."""
