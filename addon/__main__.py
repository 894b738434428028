"""``python -m addon`` is the same as the command ``sketch2face``."""

from addon.cli import main

raise SystemExit(main())
