"""The Debian packages of this tree, unpacked."""
import pathlib
import subprocess
import tempfile

NAMES = ("tubed", "libtubed-shm1", "libtubed-dev")


class Failure(Exception):
    """What was promised is not so."""


def check(condition, message):
    if not condition:
        raise Failure(message)


class Unpacked:
    """A folder with one tree a package. Use as a context manager: {name: tree}."""

    def __init__(self, packages):
        self._packages = pathlib.Path(packages)

    def __enter__(self):
        self._folder = tempfile.TemporaryDirectory(prefix="tubed-packages-")
        trees = {}
        for name in NAMES:
            found = sorted(self._packages.glob(f"{name}_*.deb"))
            check(len(found) == 1, f"packages {name} in {self._packages}: {found}")
            trees[name] = pathlib.Path(self._folder.name) / name
            subprocess.run(["dpkg-deb", "-x", str(found[0]), str(trees[name])], check=True)
        return trees

    def __exit__(self, *_):
        self._folder.cleanup()
