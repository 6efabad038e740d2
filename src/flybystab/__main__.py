"""``python -m flybystab``: the command line."""

from flybystab.cli.main import main

raise SystemExit(main())
