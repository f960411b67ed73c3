"""What stands around the machine: sun, pump and pipe. Imports base."""
