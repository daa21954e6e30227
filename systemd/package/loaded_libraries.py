"""Which Debian packages the installed programs load, and through whom."""
import dataclasses
import os
import pathlib
import re
import subprocess


def said_by(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@dataclasses.dataclass
class Package:
    """An installed Debian package."""
    name: str
    version: str
    source: str
    source_version: str
    architecture: str
    maintainer: str
    homepage: str
    programs: set = dataclasses.field(default_factory=set)  # of ours, that load something of it
    direct: set = dataclasses.field(default_factory=set)  # of these, that name it themselves
    sonames: set = dataclasses.field(default_factory=set)
    is_compiled_in: bool = False  # headers or a static library: nothing of it is loaded


def package_named(name):
    form = "\t".join(f"${{{field}}}" for field in ("Package", "Version", "source:Package", "source:Version", "Architecture", "Maintainer",
                                                    "Homepage"))
    return Package(*said_by("dpkg-query", "-W", f"-f={form}\n", name).splitlines()[0].split("\t"))


def owners_of(paths):
    """{path: the package that brought it}, whatever links lead to it. Throws when none did."""
    spelled = {}  # with and without /usr, behind links or not: the same file
    for path in paths:
        for one in (path, os.path.realpath(path)):
            spelled.update({one: path, "/usr" + one: path, one.removeprefix("/usr"): path})
    found = subprocess.run(["dpkg", "-S", *spelled], capture_output=True, text=True, check=False).stdout
    owners = {spelled[path]: words.split(":")[0].split(",")[0]
              for words, path in (line.rsplit(": ", 1) for line in found.splitlines()) if path in spelled}
    strange = sorted(set(paths) - set(owners))
    if strange:
        raise RuntimeError(f"no Debian package brought {', '.join(strange)}: programs must not be packaged against it")
    return owners


def programs_in(tree):
    """Dynamically linked programs and libraries below a folder."""
    for path in sorted(pathlib.Path(tree).rglob("*")):
        if path.is_file() and not path.is_symlink():
            with open(path, "rb") as file:
                head = file.read(18)
            if head[:4] == b"\x7fELF" and head[16] in (2, 3):  # ET_EXEC, ET_DYN
                yield path


def needed_by(program):
    return set(re.findall(r"\(NEEDED\).*\[(.+)\]", said_by("readelf", "-dW", str(program))))


def loaded_by(program):
    """{soname: path} of everything the dynamic linker loads for a program."""
    found = dict(re.findall(r"^\s*(\S+) => (/\S+)", said_by("ldd", str(program)), re.MULTILINE))
    missing = re.findall(r"^\s*(\S+) => not found", said_by("ldd", str(program)), re.MULTILINE)
    if missing:
        raise RuntimeError(f"{program} needs {' '.join(missing)}, which this machine does not have")
    return found


def packages_loaded_by(trees):
    """{name: Package} of all programs below the folders; our own libraries are left out."""
    programs = {program: loaded_by(program) for tree in trees for program in programs_in(tree)}
    owners = owners_of({path for loaded in programs.values() for path in loaded.values()})
    packages = {name: package_named(name) for name in sorted(set(owners.values()))}
    for program, loaded in programs.items():
        direct = needed_by(program)
        for soname, path in loaded.items():
            package = packages[owners[path]]
            package.programs.add(program.name)
            package.sonames.add(soname)
            if soname in direct:
                package.direct.add(program.name)
    return packages
