"""A machine with systemd of its own: a container on a copy-on-write layer over this host's root.

Nothing it does reaches the host. What is missing for it is a Skip with the package to install.
"""
import os
import pathlib
import shutil
import subprocess
import tempfile

from bed import Skip, check

# What a container has no use for, or what would wait for hardware and networks.
MASKED = ("systemd-udevd.service", "systemd-logind.service", "systemd-timesyncd.service", "systemd-firstboot.service",
          "systemd-sysusers.service", "systemd-resolved.service", "systemd-networkd.service", "ssh.service", "cron.service",
          "getty.target", "console-getty.service", "apt-daily.timer", "apt-daily-upgrade.timer", "man-db.timer", "e2scrub_all.timer",
          "docker.service", "docker.socket", "containerd.service", "prometheus.service", "prometheus-node-exporter.service")

INSIDE = """[Unit]
Description=the checks inside
DefaultDependencies=no
After=basic.target dbus.service systemd-journald.service
Wants=basic.target dbus.service
[Service]
Type=oneshot
ExecStart=/usr/bin/python3 /checks/{script} /checks/results
ExecStopPost=/usr/bin/systemctl poweroff --force
StandardOutput=append:/checks/output
StandardError=inherit
TimeoutStartSec={timeout_s}
"""


def need(tool, package):
    if shutil.which(tool, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin") is None:
        raise Skip(f"no {tool}: apt-get install {package}")


class Container:
    """A root to install in and to boot. Use as a context manager."""

    def __enter__(self):
        need("systemd-nspawn", "systemd-container")
        if os.geteuid() != 0:
            raise Skip("containers need root")
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="tubed-nspawn-"))
        self.root = self.folder / "merged"
        for name in ("upper", "work", "merged"):
            (self.folder / name).mkdir()
        mounted = subprocess.run(["mount", "-t", "overlay", "-o", f"lowerdir=/,upperdir={self.folder}/upper,workdir={self.folder}/work",
                                  "overlay", str(self.root)], capture_output=True, text=True, check=False)
        if mounted.returncode != 0:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise Skip(f"no overlay file system here: {mounted.stderr.strip()}")
        return self

    def __exit__(self, *_):
        subprocess.run(["umount", "-l", str(self.root)], check=False)
        shutil.rmtree(self.folder, ignore_errors=True)

    def run(self, *command):
        """Runs a command on the root without booting it: completed process with text."""
        return subprocess.run(["systemd-nspawn", "-q", "-D", str(self.root), "--register=no", "--keep-unit", "--private-network",
                               "--link-journal=no", "-P", *command], capture_output=True, stdin=subprocess.DEVNULL, text=True,
                              check=False, timeout=120)

    def copy_in(self, source, place):
        target = self.root / place.lstrip("/")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target)

    def boot(self, script, timeout_s, modules=()):
        """Boots, runs the Python script inside as root until it ends; lines it wrote to results, and what else was said.

        `modules`: files that the script imports.
        """
        for file in (script, *modules):
            self.copy_in(file, f"/checks/{pathlib.Path(file).name}")
        units = self.root / "etc/systemd/system"
        for unit in MASKED:
            (units / unit).unlink(missing_ok=True)
            (units / unit).symlink_to("/dev/null")
        (self.root / "etc/fstab").write_text("")
        (units / "checks.service").write_text(INSIDE.format(script=pathlib.Path(script).name, timeout_s=timeout_s))
        command = ["systemd-nspawn", "-q", "-D", str(self.root), "--register=no", "--keep-unit", "--private-network",
                   "--link-journal=no", "--capability=CAP_IPC_LOCK,CAP_SYS_NICE", "--rlimit=RTPRIO=99", "--rlimit=MEMLOCK=infinity", "--console=pipe",
                   "-b", "systemd.unit=checks.service", "systemd.show_status=no"]
        booted = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, check=False,
                                timeout=timeout_s + 60)
        results = self.root / "checks/results"
        said = (self.root / "checks/output")
        words = said.read_text(errors="replace") if said.exists() else ""
        words += booted.stdout.decode(errors="replace")[-4000:]
        check(results.exists(), f"the container said nothing (exit {booted.returncode}):\n{words}")
        return results.read_text().splitlines(), words
