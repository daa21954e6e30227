"""Writes from the .idl files what would repeat them: wire_fields.py IDL_FOLDER OUTPUT_FOLDER, or wire_fields.py --self-test.

wire_fields.h: TUBED_FIELDS_OF_<struct>(FIELD, LIST) for every struct, FIELD(name) once for each field in its order; where the struct
says by a field <word>_count how much of an array is used, the array, whose name begins with that word, is LIST(name, count) instead.
shm_estimate.h: the structs of TubeEstimate.idl in C, without a DDS header, as they lie in shared memory.

That layout is a contract with its version in TubeEstimate.idl, beside a digest of the fields: a change of the fields without a new
version ends the build.
"""
import pathlib
import re
import sys
import tempfile
import zlib

STRUCT = re.compile(r"^\s*@final struct (\w+) \{$")
MEMBER = re.compile(r'^\s*(?:@key\s+)?(?:@unit\("[^"]+"\)\s+)?((?:unsigned )?long(?: long)?|double|float|boolean|string<\d+>|[A-Z]\w+)\s+'
                    r"(\w+)((?:\[\d+\])*);\s*(?://\s*(.*))?$")
COMMENT = re.compile(r"^\s*//\s?(.*)$")
VERSION = re.compile(r"^\s*const unsigned long TUBE_ESTIMATE_VERSION = (\d+);\s*// layout ([0-9a-f]{8})\b")
IN_C = {"unsigned long": "uint32_t", "long": "int32_t", "unsigned long long": "uint64_t", "long long": "int64_t", "double": "double",
        "float": "float", "boolean": "bool"}
SHM_NAMES = {"CentrelinePoint": "tubed_shm_point", "CoilResidual": "tubed_shm_coil", "ViewUsed": "tubed_shm_view", "StageStamps": "tubed_shm_stamps",
             "TubeEstimate": "tubed_shm_estimate"}
MADE = "/* Made by idl/wire_fields.py from the .idl files. */\n"


class Fault(Exception):
    """Words that say where."""


def structs_of(file):
    """[(name, comment, [[type, name, dimensions, comment]])] in the order of the file."""
    structs, comment, fields = [], "", None
    for number, line in enumerate(file.read_text().splitlines(), 1):
        begun, member, said = STRUCT.match(line), MEMBER.match(line), COMMENT.match(line)
        if begun:
            fields = []
            structs.append((begun.group(1), comment.strip(), fields))
        elif fields is not None and line.strip() == "};":
            fields = None
        elif fields is not None and member:
            fields.append([member.group(1), member.group(2), member.group(3), (member.group(4) or "").strip()])
        elif fields is not None and said and fields:
            fields[-1][3] += " " + said.group(1).strip()
        elif fields is not None and line.strip():
            raise Fault(f"{file}:{number}: not understood: {line.strip()}")
        comment = f"{comment} {said.group(1).strip()}" if said else ""
    return structs


def field_table(name, fields):
    """The macro of one struct."""
    words = [field[: -len("_count")] for _, field, _, _ in fields if field.endswith("_count")]
    rows = []
    for _, field, dimensions, _ in fields:
        counts = [word for word in words if dimensions and field.startswith(word)]
        rows.append(f"LIST({field}, {counts[0]}_count)" if counts else f"FIELD({field})")
    return f"#define TUBED_FIELDS_OF_{name}(FIELD, LIST) \\\n  " + " \\\n  ".join(rows) + "\n"


def fields_header(structs):
    names = " \\\n  ".join(f"STRUCT({name})" for name, _, _ in structs)
    return (f"{MADE}#ifndef TUBED_WIRE_FIELDS_H\n#define TUBED_WIRE_FIELDS_H\n\n"
            "/* Every struct, those it contains before it. */\n"
            f"#define TUBED_STRUCTS(STRUCT) \\\n  {names}\n\n" + "\n".join(field_table(name, fields) for name, _, fields in structs) +
            "\n#endif\n")


def member_in_c(kind, name, dimensions, comment):
    text = re.match(r"string<(\d+)>", kind)
    if text:
        kind, dimensions = "char", f"[{int(text.group(1)) + 1}]"
    elif kind in SHM_NAMES:
        kind = "struct " + SHM_NAMES[kind]
    else:
        kind = IN_C[kind]
    return f"  {kind} {name}{dimensions};" + (f" /* {comment} */" if comment else "")


def digest_of(structs):
    text = ";".join(f"{name}:" + ",".join(" ".join(field[:3]) for field in fields) for name, _, fields in structs)
    return f"{zlib.crc32(text.encode()):08x}"


def version_of(file, structs):
    """The stated version, when it is the one of these fields."""
    digest = digest_of(structs)
    for number, line in enumerate(file.read_text().splitlines(), 1):
        stated = VERSION.match(line)
        if stated:
            if stated.group(2) != digest:
                raise Fault(f"{file}:{number}: TubeEstimate has other fields than version {stated.group(1)}, which programs read in shared "
                            f"memory: make it TUBE_ESTIMATE_VERSION = {int(stated.group(1)) + 1}, // layout {digest}")
            return stated.group(1)
    raise Fault(f"{file}: states no TUBE_ESTIMATE_VERSION with // layout {digest}")


def shm_header(file):
    structs = structs_of(file)
    parts = [f"{MADE}#ifndef TUBED_SHM_ESTIMATE_H\n#define TUBED_SHM_ESTIMATE_H\n\n#include <stdbool.h>\n#include <stdint.h>\n\n"
             f"#define TUBED_SHM_ESTIMATES_VERSION {version_of(file, structs)}u\n"]
    for name, comment, fields in structs:
        said = f"/* {comment} */\n" if comment else ""
        parts.append(said + f"struct {SHM_NAMES[name]} {{\n" + "\n".join(member_in_c(*field) for field in fields) + "\n};\n")
    return "\n".join(parts) + "\n#endif\n"


def write(source, output):
    files = sorted(source.glob("*.idl"))
    (output / "wire_fields.h").write_text(fields_header([struct for file in files for struct in structs_of(file)]))
    (output / "shm_estimate.h").write_text(shm_header(source / "TubeEstimate.idl"))


def self_test():
    good = ('module tubed {\n  @final struct TubeEstimate {\n    @key string<8> id;\n    @unit("mm") double a_mm[3];  // first\n'
            "                                 // and more\n    unsigned long tool_count;\n    boolean tools[4][2];\n  };\n"
            "  const unsigned long TUBE_ESTIMATE_VERSION = 3;  // layout %s\n};\n")
    with tempfile.TemporaryDirectory() as folder:
        source, idl = pathlib.Path(folder), pathlib.Path(folder) / "TubeEstimate.idl"
        idl.write_text(good)
        digest = digest_of(structs_of(idl))
        idl.write_text(good % digest)
        write(source, source)
        table, layout = (source / "wire_fields.h").read_text(), (source / "shm_estimate.h").read_text()
        for words, text in (("FIELD(id) \\\n  FIELD(a_mm) \\\n  FIELD(tool_count) \\\n  LIST(tools, tool_count)\n", table),
                            ("  char id[9];\n  double a_mm[3]; /* first and more */\n", layout), ("_VERSION 3u\n", layout),
                            ("  bool tools[4][2];\n", layout)):
            assert words in text, (words, text)
        for change in (("double a_mm", "float a_mm"), ("a_mm[3]", "a_mm[4]"), ("    @key string<8> id;\n", ""), ("string<8>", "string<9>"),
                       ("boolean", "wchar"), ("VERSION", "EDITION")):
            idl.write_text((good % digest).replace(*change))
            try:
                write(source, source)
            except Fault as fault:
                assert str(idl) in str(fault), fault
            else:
                raise AssertionError(f"{change} was taken")
    print("fields, their lists and their version are found; 6 wrong files are refused")


def main():
    if sys.argv[1] == "--self-test":
        self_test()
        return 0
    try:
        write(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
    except Fault as fault:
        print(fault, file=sys.stderr)
        return 1
    return 0


sys.exit(main())
