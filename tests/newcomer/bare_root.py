"""A bare Debian 12: what debootstrap's variant minbase unpacks, with nothing of the host in it but its way to the archive.

Programs run inside in a mount and a process namespace of their own: when the first of them ends, the others end and every mount is
gone with them. The network is the host's, because packages come through it.
"""
import ctypes
import os
import pathlib
import re
import shutil
import signal
import subprocess

CODENAME = "bookworm"
# How apt reaches the archive and what it demands of it; how much it fetches is Debian's default.
WAY_TO_THE_ARCHIVE = re.compile(r"Acquire::(\w+::)*(Proxy(::.*)?|Check-Valid-Until|Check-Date|Verify-\w+|Ca\w+|Retries|Timeout) \"")
PROXIES = ("http_proxy", "https_proxy", "no_proxy")
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"

# $1: the root; what follows is the command. Device nodes are those that debootstrap made.
ENTER = """set -e
mount -t proc proc "$1/proc"
mount -t sysfs -o ro sysfs "$1/sys"
mkdir -p "$1/dev/pts" "$1/dev/shm"
mount -t devpts -o newinstance,ptmxmode=0666 devpts "$1/dev/pts"
mount -t tmpfs tmpfs "$1/dev/shm"
cd /
root=$1; shift
exec chroot "$root" /usr/bin/env -i "$@"
"""


class Skip(Exception):
    """What is missing on this machine, and how to get it."""


def need(tool, package):
    found = shutil.which(tool, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")
    if found is None:
        raise Skip(f"no {tool}: apt-get install {package}")
    return found


def die_with_parent():
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def lines_of(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


def archives():
    """Where this host gets Debian 12 from: lines of sources.list."""
    targets = lines_of("apt-get", "indextargets", "Created-By: Packages", "Origin: Debian", "--format", "$(REPO_URI) $(CODENAME) $(COMPONENT)")
    found = [target.split() for target in targets]
    lines = [f"deb {uri} {codename} {component}" for uri, codename, component in found if codename.startswith(CODENAME)]
    if not any(f" {CODENAME} main" in line for line in lines):
        raise Skip(f"apt of this machine knows no archive of Debian's {CODENAME}: put one into /etc/apt, then apt-get update")
    return lines


def apt_options():
    """What this host says of its way to the archive, as apt.conf has it."""
    options = lines_of("apt-config", "dump", "--no-empty", "--format", '%F "%v";%n')
    return [option for option in options if WAY_TO_THE_ARCHIVE.match(option)]


def make_tarball(tarball, folder):
    """Keeps the bare root for later runs; what is installed from then on is fetched each time."""
    debootstrap = need("debootstrap", "debootstrap")
    sources = archives()
    mirror = next(line.split()[1] for line in sources if f" {CODENAME} main" in line)
    extra = ["--include=ca-certificates"] if any(" https:" in line for line in sources) else []
    # It mounts /proc in there: in a namespace, where the mount ends with it even when it is killed.
    alone = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", "--propagation", "private"]
    made = subprocess.run([*alone, debootstrap, "--variant=minbase", *extra, CODENAME, str(folder), mirror], text=True, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=die_with_parent)
    if made.returncode != 0:
        last = "\n".join(made.stdout.splitlines()[-5:])
        raise Skip(f"debootstrap makes no root here; is there a network, and may {folder} hold device nodes?\n{last}")
    for archive in (folder / "var/cache/apt/archives").glob("*.deb"):
        archive.unlink()
    part = tarball.with_suffix(".part")
    subprocess.run(["tar", "-C", str(folder), "--one-file-system", "-cf", str(part), "."], check=True)
    part.rename(tarball)


class BareRoot:
    """A root of its own. Use as a context manager: `work` keeps the tarball, and the root is removed from it."""

    def __init__(self, work):
        self.work = pathlib.Path(work).resolve()
        self.root = self.work / "root"
        self.environment = ["HOME=/root", "TERM=dumb", "LANG=C.UTF-8", f"PATH={PATH}",
                            *(f"{name}={os.environ[name]}" for name in PROXIES if name in os.environ)]

    def __enter__(self):
        if os.geteuid() != 0:
            raise Skip("a root to install in needs root: sudo, or run as root")
        need("unshare", "util-linux")
        self.work.mkdir(parents=True, exist_ok=True)
        self.remove()
        tarball = self.work / f"{CODENAME}-minbase.tar"
        if not tarball.exists():
            make_tarball(tarball, self.root)
            self.remove()
        self.root.mkdir()
        subprocess.run(["tar", "-C", str(self.root), "-xpf", str(tarball)], check=True)
        apt = self.root / "etc/apt"
        (apt / "sources.list").write_text("\n".join(archives()) + "\n")
        (apt / "apt.conf.d/99way-to-the-archive").write_text("\n".join(apt_options()) + "\n")
        for name in ("resolv.conf", "hosts"):
            (self.root / "etc" / name).unlink(missing_ok=True)
            shutil.copy(f"/etc/{name}", self.root / "etc" / name)
        return self

    def __exit__(self, *_):
        self.remove()

    def remove(self):
        if self.root.exists():
            if self.root.is_mount() or any(str(self.root) in line for line in open("/proc/mounts", encoding="utf-8")):
                raise RuntimeError(f"something is mounted below {self.root}: not removed")
            shutil.rmtree(self.root)

    def start(self, command, folder="/", **options):
        """A process inside, of this one command and its arguments; its program is the first process of the namespace."""
        return subprocess.Popen(["unshare", "--mount", "--pid", "--fork", "--kill-child", "--propagation", "private", "sh", "-c", ENTER,
                                 "enter", str(self.root), *self.environment, "sh", "-c", f"cd {folder} && exec {command}"],
                                stdin=subprocess.DEVNULL, preexec_fn=die_with_parent, **options)

    def packages(self):
        """How many are installed."""
        status = (self.root / "var/lib/dpkg/status").read_text(encoding="utf-8")
        return len(re.findall(r"^Status: install ok installed$", status, re.MULTILINE))


def first_inside(process):
    """The process number, seen from outside, of what start() started: `unshare` itself stays outside; 0 when it has ended."""
    try:
        children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="ascii").split()
    except OSError:
        return 0
    return int(children[0]) if children else 0


def processor_s(pid):
    """Seconds of processor of this process and of all that it has waited for; 0 when it is gone."""
    try:
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(int(field) for field in fields[11:15]) / os.sysconf("SC_CLK_TCK")
