"""tubed as a service, from its Debian packages, on a machine of its own: service.py PACKAGES lifecycle|service|security|lint."""
import pathlib
import shutil
import subprocess
import sys
import tempfile

import nspawn
from bed import SKIP, Failure, Skip, check, say

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parent.parent
UNITS = SOURCE / "systemd"
EXPOSURE = 15  # tenths; tubed.service has 1.5, the other units less
CONFIGURATION = "etc/tubed/tubed.toml"


def packages_in(folder):
    found = {name: next(pathlib.Path(folder).glob(f"{name}_*.deb"), None) for name in ("tubed", "libtubed-shm1", "libtubed-dev")}
    check(all(found.values()), f"no packages in {folder}: {found}")
    return found


def installed(container, *packages):
    for package in packages:
        container.copy_in(package, f"/checks/{package.name}")
    done = container.run("dpkg", "--force-confdef", "--force-confold", "-i", *(f"/checks/{package.name}" for package in packages))
    check(done.returncode == 0, f"dpkg -i: {done.stdout}{done.stderr}")


def newer(package, folder):
    """The same package as a later version with another sample configuration."""
    tree = pathlib.Path(folder) / "newer"
    subprocess.run(["dpkg-deb", "-R", str(package), str(tree)], check=True)
    control = tree / "DEBIAN/control"
    control.write_text(control.read_text().replace("Version: 0.1.0-1", "Version: 0.1.0-1+later"))
    configuration = tree / CONFIGURATION
    configuration.write_text("# another sample\n" + configuration.read_text())
    target = pathlib.Path(folder) / "tubed_later.deb"
    subprocess.run(["dpkg-deb", "-b", str(tree), str(target)], check=True, stdout=subprocess.DEVNULL)
    return target


def lifecycle(packages):
    """Install, upgrade keeping the configuration, remove, purge."""
    with nspawn.Container() as container, tempfile.TemporaryDirectory() as folder:
        configuration = container.root / CONFIGURATION
        installed(container, packages["tubed"], packages["libtubed-shm1"], packages["libtubed-dev"])
        checked = container.run("/usr/sbin/tubed", "--check", f"/{CONFIGURATION}")
        check(checked.returncode == 0, f"the installed configuration is wrong: {checked.stdout}{checked.stderr}")

        check((container.root / "usr/share/tubed/tubed_aurora.dbc").exists(), "no description of the CAN frames is installed")
        check((container.root / "usr/share/tubed/tubed.nft").exists(), "no firewall file is installed")
        check((container.root / "usr/share/tubed/can.conf").exists(), "no drop-in for trackers behind CAN is installed")
        configuration.write_text("# mine\n" + configuration.read_text())
        installed(container, newer(packages["tubed"], folder))
        version = container.run("dpkg-query", "-W", "-f=${Version}", "tubed").stdout
        check(version.strip() == "0.1.0-1+later", f"after the upgrade there is version {version}")
        check(configuration.read_text().startswith("# mine\n"), "the upgrade changed the configuration")

        removed = container.run("dpkg", "-r", "tubed")
        check(removed.returncode == 0, f"dpkg -r: {removed.stdout}{removed.stderr}")
        check(not (container.root / "usr/sbin/tubed").exists(), "the program is left after removal")
        check(configuration.exists(), "removal took the configuration")

        # As the service, another room's and the administrator leave them.
        left = ("var/lib/tubed", "var/log/tubed", "var/lib/tubed-left", "var/log/tubed-left")
        for place in left:
            (container.root / place).mkdir(exist_ok=True)
            (container.root / place / "kept").write_text("")
        (container.root / "etc/tubed/left.toml").write_text("# another room\n")
        # /run is the container's own, made anew each time.
        purged = container.run("sh", "-c", "mkdir /run/tubed /run/tubed-left; dpkg -P tubed && ! ls -d /run/tubed*")
        check(purged.returncode == 0, f"dpkg -P, or /run/tubed is left: {purged.stdout}{purged.stderr}")
        for place in ("etc/tubed", "usr/share/tubed", *left):
            check(not (container.root / place).exists(), f"/{place} is left after purging")
        for name in ("passwd", "group", "shadow", "gshadow"):
            check("tubed" not in (container.root / "etc" / name).read_text(), f"/etc/{name} still has tubed after purging")
        found = [path for folder in ("etc", "lib/systemd", "lib/udev", "usr/lib/systemd", "usr/lib/udev", "usr/lib/sysusers.d",
                                     "usr/lib/tmpfiles.d", "usr/sbin", "usr/bin", "usr/share", "var/lib/systemd")
                 for path in (container.root / folder).rglob("*tubed*")
                 if "libtubed" not in str(path)]
        check(not found, f"left after purging: {found}")
    say("installed, upgraded with its configuration kept, removed, purged")


def service(packages):
    """Everything that service_inside.py says."""
    with nspawn.Container() as container:
        installed(container, packages["tubed"])
        results, words = container.boot(HERE / "service_inside.py", 150,
                                        [HERE / "service_commands.py", HERE / "service_trackers_inside.py"])
        for line in results:
            say(line)
        failed = [line for line in results if line.startswith("FAILED: ")]
        passed = [line for line in results if line.startswith("passed: ")]
        check(not failed and len(passed) == 23, f"{len(failed)} failed, {len(passed)} passed, expected 23\n{words}")


def security(packages):
    """The sandbox of each unit, as systemd judges it; and that every unit can be understood."""
    nspawn.need("systemd-analyze", "systemd")
    with tempfile.TemporaryDirectory() as folder:
        tree = pathlib.Path(folder) / "tree"
        subprocess.run(["dpkg-deb", "-x", str(packages["tubed"]), str(tree)], check=True)
        units = sorted((tree / "lib/systemd/system").glob("tubed*.service"))
        check(len(units) >= 4, f"units in the package: {units}")
        for unit in units:
            shutil.copy(unit, folder)
            judged = subprocess.run(["systemd-analyze", "security", "--offline=true", f"--threshold={EXPOSURE}", f"{folder}/{unit.name}"],
                                    capture_output=True, text=True, check=False)
            say(judged.stdout.strip().splitlines()[-1])
            check(judged.returncode == 0, f"{unit.name} is exposed more than {EXPOSURE / 10}:\n{judged.stdout}{judged.stderr}")
            verified = subprocess.run(["systemd-analyze", "verify", "--man=no", f"{folder}/{unit.name}"],
                                      capture_output=True, text=True, check=False)
            wrong = [line for line in verified.stderr.splitlines() if unit.name in line and "is not executable" not in line]
            check(not wrong, "\n".join(wrong))
        plain, template = ((UNITS / name).read_text() for name in ("tubed.service", "tubed@.service"))
        same = template.split("[Unit]", 1)[1].replace("tubed-%i", "tubed").replace("/%i.toml", "/tubed.toml").replace("shape of %i", "shape")
        check(same == plain.split("[Unit]", 1)[1], "tubed@.service says something else than tubed.service")


def is_machine_code(remark):
    """lintian takes bytes of machine code for words: a word that no source file has is none."""
    fields = remark.split()
    if "spelling-error-in-binary" not in fields:
        return False
    word = fields[fields.index("spelling-error-in-binary") + 1].encode()
    return not any(word in path.read_bytes() for folder in ("clients", "daemon", "drivers", "idl")
                   for path in (SOURCE / folder).rglob("*.[ch]pp"))


def lint(packages):
    """Debian's own judgement of the packages, down to its remarks: what stays is overridden, with the reason beside it."""
    nspawn.need("lintian", "lintian")
    judged = subprocess.run(["lintian", "--allow-root", "--display-info", "--fail-on", "none", *map(str, packages.values())],
                            capture_output=True, text=True, check=False)
    say(judged.stdout.strip() or "no error, no warning, no remark")
    remarks = [line for line in judged.stdout.splitlines() if line[:2] in ("E:", "W:", "I:") and not is_machine_code(line)]
    check(not remarks and judged.returncode == 0, "\n".join(remarks) + judged.stderr)
    pedantic = subprocess.run(["lintian", "--allow-root", "--pedantic", *map(str, packages.values())], capture_output=True, text=True, check=False)
    say("pedantic, for information: " + (pedantic.stdout.strip().replace("\n", "; ") or "nothing"))


def main():
    scenarios = {scenario.__name__: scenario for scenario in (lifecycle, service, security, lint)}
    try:
        scenarios[sys.argv[2]](packages_in(sys.argv[1]))
    except Skip as missing:
        say(f"SKIPPED: {missing}")
        return SKIP
    except Failure as failure:
        say(f"FAILED: {failure}")
        return 1
    return 0


sys.exit(main())
