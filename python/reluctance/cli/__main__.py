"""`python -m reluctance.cli`."""

from reluctance.cli.main import main

main()
