"""Where a drive goes: firmware, mock-up units, bench, browser, environments. Imports explore and
what is below it."""
