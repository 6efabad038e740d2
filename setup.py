"""Build in an empty folder: files that an earlier version left in ``build/`` do not reach the wheel.

Everything else is in ``pyproject.toml``.
"""

import atexit
import shutil
import tempfile

from setuptools import setup
from setuptools.command.build import build


class BuildInEmptyFolder(build):
    """Build command of setuptools, which otherwise adds to ``build/lib`` and packs all files that it finds there."""

    def initialize_options(self):
        """Set the folder."""
        super().initialize_options()
        self.build_base = tempfile.mkdtemp(prefix="flybystab-build-")
        atexit.register(shutil.rmtree, self.build_base, ignore_errors=True)


setup(cmdclass={"build": BuildInEmptyFolder})
