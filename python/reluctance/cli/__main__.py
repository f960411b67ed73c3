"""`python -m reluctance.cli`."""

from reluctance.cli.entry import main

main()
