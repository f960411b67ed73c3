"""One drive: described, controlled, protected and simulated. Imports machine, plant and base."""
