"""Licences of a Debian package as SPDX 2.3 says them, from the machine-readable form of debian/copyright (DEP 5)."""
import dataclasses
import pathlib
import re

# Debian's short names that SPDX spells otherwise; those that SPDX spells the same are in SPDX_NAMES.
SPDX_OF_DEBIAN = {
    "apache-2": "Apache-2.0", "apache-2.0": "Apache-2.0", "bsd-2-clause": "BSD-2-Clause", "bsd-2": "BSD-2-Clause",
    "bsd-3-clause": "BSD-3-Clause", "bsd-4-clause": "BSD-4-Clause", "expat": "MIT", "mit": "MIT", "isc": "ISC", "zlib": "Zlib",
    "bsl-1.0": "BSL-1.0", "boost-1.0": "BSL-1.0", "mpl-1.1": "MPL-1.1", "mpl-2.0": "MPL-2.0", "epl-2": "EPL-2.0", "epl-2.0": "EPL-2.0",
    "ftl": "FTL", "ijg": "IJG", "libpng": "Libpng", "curl": "curl", "hpnd": "HPND", "x11": "X11", "postgresql": "PostgreSQL",
    "openldap-2.8": "OLDAP-2.8", "oldap-2.8": "OLDAP-2.8", "cc0-1.0": "CC0-1.0", "cc-by-4.0": "CC-BY-4.0", "beerware": "Beerware",
    "qhull": "Qhull", "ntp": "NTP", "fsfap": "FSFAP", "fsfullr": "FSFULLR",
}
GNU = re.compile(r"(gpl|lgpl)-(1|2|2\.0|2\.1|3|3\.0)(\+)?$")


@dataclasses.dataclass
class Licences:
    declared: str  # an SPDX expression, or NOASSERTION
    others: list  # Debian's short names that the copyright file has for single files
    texts: dict  # LicenseRef-... -> (Debian's short name, its text)


def _paragraphs(text):
    """DEP 5's paragraphs as {field in lower case: value with its lines}."""
    for paragraph in re.split(r"\n[ \t]*\n(?=\S)", text):
        fields, name = {}, None
        for line in paragraph.splitlines():
            if line[:1] in " \t" and name:
                fields[name] += "\n" + line.strip()
            elif ":" in line and not line.startswith("#"):
                name, value = line.split(":", 1)
                name = name.strip().lower()
                fields[name] = value.strip()
        yield fields


def _one(short_name, texts, written):
    """SPDX for one of Debian's short names; what SPDX does not know becomes a reference with its text."""
    key = short_name.strip().lower()
    gnu = GNU.match(key)
    if gnu:
        version = gnu[2] if "." in gnu[2] else gnu[2] + ".0"
        return f"{gnu[1].upper()}-{version}-{'or-later' if gnu[3] else 'only'}"
    if key in SPDX_OF_DEBIAN:
        return SPDX_OF_DEBIAN[key]
    reference = "LicenseRef-debian-" + re.sub(r"[^A-Za-z0-9.]+", "-", short_name.strip()).strip("-")
    texts[reference] = (short_name.strip(), written.get(key) or "Named in Debian's copyright file, without a text of its own.")
    return reference


def _expression(licence, texts, written):
    """SPDX for DEP 5's "A or B and C": "and" binds closer, a comma before it looser."""
    words = re.split(r"\s*,?\s+(and/or|and|or)\s+", licence.strip().rstrip(","), flags=re.IGNORECASE)
    parts = [_one(words[0], texts, written)]
    for joint, name in zip(words[1::2], words[2::2]):
        parts += ["AND" if joint.lower() == "and" else "OR", _one(name, texts, written)]
    return parts[0] if len(parts) == 1 else "(" + " ".join(parts) + ")"


def licences_of(package, folder="/usr/share/doc"):
    """What Debian's copyright file of an installed package declares for the whole of its source (Files: *)."""
    try:
        text = pathlib.Path(folder, package, "copyright").read_text(errors="replace")
    except OSError:
        return Licences("NOASSERTION", [], {})
    if not re.match(r"\s*format(-specification)?:", text, re.IGNORECASE):
        return Licences("NOASSERTION", [], {})
    paragraphs = list(_paragraphs(text))
    split = [(fields, *(fields.get("license", "").split("\n", 1) + [""])[:2]) for fields in paragraphs]
    written = {name.strip().lower(): words.strip() for _, name, words in split if words.strip()}
    named = [(fields.get("files", "").split(), name) for fields, name, _ in split if "files" in fields and name]
    whole = next((name for files, name in named if "*" in files), None)
    texts = {}
    declared = _expression(whole, texts, written) if whole else "NOASSERTION"
    others = sorted({name.strip() for _, name in named} - {(whole or "").strip()})
    return Licences(declared, others, texts)
