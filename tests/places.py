"""Where things are."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Files that nobody here wrote; not everywhere: ask is_dir().
CORPUS = Path(os.environ.get("PARADIZE_CORPUS", ROOT.parent / "shared" / "corpus"))
