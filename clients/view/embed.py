#!/usr/bin/env python3
"""Makes C++ of the files of a page: embed.py FOLDER OUTPUT.cpp"""
import pathlib
import sys

TYPES = {".html": "text/html; charset=utf-8", ".css": "text/css; charset=utf-8", ".js": "text/javascript; charset=utf-8",
         ".svg": "image/svg+xml"}


def bytes_of(data):
    """As the elements of an array, 32 a line: string literals of any length are an extension."""
    return ",\n    ".join(",".join(str(byte) for byte in data[i:i + 32]) for i in range(0, len(data), 32))


def main(folder, output):
    files = sorted(path for path in pathlib.Path(folder).iterdir() if path.suffix in TYPES)
    text = ('// Made by clients/view/embed.py.\n#include <array>\n\n#include "clients/view/page_files.hpp"\n\n'
            "namespace tubed {\n\nnamespace {\n\n")
    for number, path in enumerate(files):
        data = path.read_bytes()
        text += f"constexpr std::array<unsigned char, {len(data)}> kFile{number}{{\n    {bytes_of(data)}}};\n"
    text += "\n}  // namespace\n\nstd::span<const PageFile> page_files() {\n  static const std::array files{\n"
    for number, path in enumerate(files):
        text += (f'      PageFile{{"/{path.name}", "{TYPES[path.suffix]}", '
                 f"{{reinterpret_cast<const char*>(kFile{number}.data()), kFile{number}.size()}}}},\n")
    text += "  };\n  return files;\n}\n\n}  // namespace tubed\n"
    pathlib.Path(output).write_text(text)


main(*sys.argv[1:])
