"""Many drives, and the bounds that they are held against. Imports drive and what is below it."""
