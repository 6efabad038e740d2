"""``python -m flybystab``: the command line."""

from flybystab.face.cli import main

raise SystemExit(main())
