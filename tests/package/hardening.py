"""How each installed program and library was built: hardening.py PACKAGES, or hardening.py --self-test COMPILER.

The self-test builds a small program once with all flags and once without each of them: every lack must be found.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

from packages import Failure, Unpacked, check

LANDING_PAD = b"\xf3\x0f\x1e\xfa"  # endbr64
STACK_GUARD = re.compile(rb"\x64\x48[\x2b\x33].\x25\x28\x00\x00\x00", re.DOTALL)  # sub or xor %fs:0x28, register: compared on return
STACK_PROBE = b"\x48\x83\x0c\x24\x00"  # orq $0, (%rsp)
# For each function: our code has 1 or more pads and 0.4 guards; Ceres, which is linked in as Debian built it, has no pads and a part of
# the guards, so that tubed without ours would have 0.0 and 0.19.
MIN_LANDING_PADS = 0.5
MIN_STACK_GUARDS = 0.22
START_FILES_PADS = 4  # of gcc's crtbegin.o and others, in every program


def said_by(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def programs_in(tree):
    for path in sorted(pathlib.Path(tree).rglob("*")):
        if path.is_file() and not path.is_symlink() and path.read_bytes()[:4] == b"\x7fELF":
            yield path


def code_of(program):
    with tempfile.NamedTemporaryFile() as section:
        subprocess.run(["objcopy", "-O", "binary", "--only-section=.text", str(program), section.name], check=True)
        return pathlib.Path(section.name).read_bytes()


def lacks_of(program, has_large_frames, has_open_sizes=True):
    """What is missing, in words. `has_large_frames`: some function has more than a page of variables, which is probed page by page;
    `has_open_sizes`: some call writes as much as is only known at run time, which the C library then checks."""
    dynamic, segments = said_by("readelf", "-dW", str(program)), said_by("readelf", "-lW", str(program))
    header, symbols = said_by("readelf", "-hW", str(program)), said_by("readelf", "--dyn-syms", "-W", str(program))
    functions = said_by("readelf", "-wF", str(program)).count(" FDE ")
    code = code_of(program)
    pads, guards = code.count(LANDING_PAD), len(STACK_GUARD.findall(code))
    is_library = ".so" in program.name
    stack = re.search(r"GNU_STACK.* (\S+)\s+0x\S+$", segments, re.MULTILINE)
    has = {
        "BIND_NOW": re.search(r"\(FLAGS\).*BIND_NOW|\(FLAGS_1\).*NOW|\(BIND_NOW\)", dynamic),
        "RELRO": "GNU_RELRO" in segments,
        "PIE": re.search(r"Type:\s+DYN", header) and (is_library or re.search(r"\(FLAGS_1\).*PIE", dynamic)),
        "a stack without execution": stack and "E" not in stack[1],
        "no text relocations": "TEXTREL" not in dynamic,
        "no search path of its own": not re.search(r"\((RPATH|RUNPATH)\)", dynamic),
        "stack protector": "__stack_chk_fail" in symbols and (not is_x86(header) or guards >= MIN_STACK_GUARDS * functions),
        "fortified calls": not has_open_sizes or re.search(r"UND __(?!stack)\w+_chk\b", symbols),
        "landing pads for indirect jumps": not is_x86(header) or pads - START_FILES_PADS >= MIN_LANDING_PADS * functions,
        "probes of large stack frames": not (is_x86(header) and has_large_frames) or STACK_PROBE in code,
    }
    return [name for name, found in has.items() if not found], f"{functions} functions, {pads} landing pads, {guards} stack guards"


def is_x86(header):
    return "X86-64" in header


def check_packages(packages):
    with Unpacked(packages) as trees:
        programs = [program for tree in trees.values() for program in programs_in(tree) if not program.name.endswith(".o")]
        check({"tubed", "tubectl", "tubed-exporter", "tubed-view"} <= {program.name for program in programs}, f"programs: {programs}")
        check(any(program.name.startswith("libtubed_shm.so") for program in programs), f"libraries: {programs}")
        wrong = []
        for program in programs:
            lacks, figures = lacks_of(program, has_large_frames=program.name in ("tubed", "tubectl"),
                                      has_open_sizes=not program.name.startswith("libtubed_shm"))
            print(f"{program.name}: {figures}; lacks {', '.join(lacks) or 'nothing'}")
            wrong += [f"{program.name} lacks {lack}" for lack in lacks]
        check(not wrong, "\n".join(wrong))


SAMPLE = r"""
#include <cstdio>
#include <cstring>
__attribute__((noinline)) void copy(const char* text, unsigned long size) { char here[64]; memcpy(here, text, size); puts(here); }
__attribute__((noinline)) void large(const char* text) { char here[20000]; strcpy(here, text); puts(here); }
template <int number> __attribute__((noinline)) void say() { char here[64]; snprintf(here, 64, "%d", number); puts(here); }
int main(int count, char** words) {
  void (*const table[])() = {say<0>, say<1>, say<2>, say<3>, say<4>, say<5>, say<6>, say<7>};
  table[count % 8]();
  copy(words[0], count);
  large(words[0]);
}
"""
# Flag -> what is missing without it; Debian's linker makes RELRO and an unexecutable stack unless told otherwise.
FLAGS = {"-Wl,-z,now": ("", "BIND_NOW"), "-Wl,-z,relro": ("-Wl,-z,norelro", "RELRO"), "-fPIE -pie": ("-fno-pie -no-pie", "PIE"),
         "-Wl,-z,noexecstack": ("-Wl,-z,execstack", "a stack without execution"), "-fstack-protector-strong": ("", "stack protector"),
         "-U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=3": ("", "fortified calls"), "-fcf-protection=full": ("", "landing pads for indirect jumps"),
         "-fstack-clash-protection": ("", "probes of large stack frames")}


def self_test(compiler):
    with tempfile.TemporaryDirectory() as folder:
        source, program = pathlib.Path(folder, "sample.cpp"), pathlib.Path(folder, "sample")
        source.write_text(SAMPLE)
        for removed in (None, *FLAGS):
            flags = " ".join(FLAGS[flag][0] if flag == removed else flag for flag in FLAGS).split()
            subprocess.run([compiler, "-O2", "-w", *flags, str(source), "-o", str(program)], check=True)
            expected = [] if removed is None else [FLAGS[removed][1]]
            lacks, _ = lacks_of(program, has_large_frames=True)
            check(lacks == expected, f"without {removed or 'nothing'}: found {lacks}, expected {expected}")
        print(f"all of {len(FLAGS)} removed flags were found")


def main():
    try:
        self_test(sys.argv[2]) if sys.argv[1] == "--self-test" else check_packages(sys.argv[1])
    except Failure as failure:
        print(f"FAILED: {failure}")
        return 1
    return 0


sys.exit(main())
