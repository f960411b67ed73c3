"""`python -m reluctance`: the command `reluctance` of this Python."""

from reluctance.cli.entry import main

main()
