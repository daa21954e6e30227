#!/usr/bin/env python3
"""What an installation consists of: make_sbom.py VERSION SOUP.toml OUTPUT_FOLDER PACKAGE=TREE...

Writes tubed.spdx.json (SPDX 2.3: our files with their sums, and every Debian package whose libraries our programs load or
contain) and SOUP.md (the same for people, with what we require of each and which of its anomalies touch us). The trees are
those that become packages; versions are those of the machine that builds. Exit 1 when SOUP.toml does not name a library that
our programs name themselves, or names one that they no longer use.
"""
import datetime
import hashlib
import json
import os
import pathlib
import re
import sys
import tomllib
import uuid

from debian_copyright import licences_of
from loaded_libraries import package_named, packages_loaded_by

TITLES = ("title", "manufacturer", "requirement")
OUR_LICENCE = "Apache-2.0"
OUTPUTS = ("tubed.spdx.json", "SOUP.md")


class Incomplete(Exception):
    """SOUP.toml and the programs do not fit."""


def identifier(kind, name):
    return f"SPDXRef-{kind}-" + re.sub(r"[^A-Za-z0-9.]", "-", name)


def build_time():
    """Of the changelog's newest entry, as dpkg-buildpackage says it: two builds of one version give one document."""
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    return datetime.datetime.fromtimestamp(seconds, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def read_soup(path, packages):
    """The list's entries; those that are compiled in are added to the packages."""
    with open(path, "rb") as file:
        entries = tomllib.load(file)["soup"]
    for entry in entries:
        lacking = [key for key in ("source", *TITLES) if not entry.get(key)]
        if lacking:
            raise Incomplete(f"{path}: an entry without {', '.join(lacking)}: {entry}")
        for name in entry.get("compiled_in", ()):
            package = packages.setdefault(name, None) or package_named(name)
            packages[name] = package
            package.is_compiled_in = True
    named = {source for entry in entries for source in entry["source"]}
    sources = {package.source for package in packages.values()}
    unnamed = sorted({package.source for package in packages.values() if package.direct or package.is_compiled_in} - named)
    if unnamed:
        raise Incomplete(f"{path}: our programs use {', '.join(unnamed)}, which no entry names: add one each, with its anomalies")
    unused = [entry for entry in entries if not sources & set(entry["source"])]
    needless = [entry["title"] for entry in unused if not entry.get("is_optional")]
    if needless:
        raise Incomplete(f"{path}: our programs no longer use {', '.join(needless)}: remove the entry")
    return [entry for entry in entries if entry not in unused]


def our_files(package, tree):
    """SPDX files of what becomes a package, and the sum over their sums."""
    files = []
    for path in sorted(pathlib.Path(tree).rglob("*")):
        relative = path.relative_to(tree)
        if path.is_symlink() or not path.is_file() or relative.parts[0] == "DEBIAN" or path.name in OUTPUTS:
            continue
        content = path.read_bytes()
        files.append({"SPDXID": identifier("File", f"{package}-{hashlib.sha1(str(relative).encode()).hexdigest()[:12]}"),
                      "fileName": f"./{relative}",
                      "checksums": [{"algorithm": "SHA1", "checksumValue": hashlib.sha1(content).hexdigest()},
                                    {"algorithm": "SHA256", "checksumValue": hashlib.sha256(content).hexdigest()}],
                      "licenseConcluded": OUR_LICENCE, "licenseInfoInFiles": ["NOASSERTION"], "copyrightText": "NOASSERTION"})
    sums = sorted(file["checksums"][0]["checksumValue"] for file in files)
    return files, hashlib.sha1("".join(sums).encode()).hexdigest()


def our_package(name, version, files, code):
    return {"SPDXID": identifier("Package", name), "name": name, "versionInfo": version, "supplier": "Organization: tubed developers",
            "downloadLocation": "NOASSERTION", "filesAnalyzed": True,
            "packageVerificationCode": {"packageVerificationCodeValue": code,
                                        "packageVerificationCodeExcludedFiles": [f"./usr/share/doc/tubed/{one}" for one in OUTPUTS]},
            "hasFiles": [file["SPDXID"] for file in files], "licenseConcluded": OUR_LICENCE, "licenseDeclared": OUR_LICENCE,
            "licenseInfoFromFiles": ["NOASSERTION"], "copyrightText": "2026 The tubed developers",
            "comment": "Research software, not a medical device."}


def debian_package(package, licences, entry):
    """SPDX for somebody else's package; `entry` of the SOUP list or nothing."""
    others = f"Single files of the source are under: {', '.join(licences.others)}." if licences.others else ""
    purl = f"pkg:deb/debian/{package.name}@{package.version}?arch={package.architecture}".replace("+", "%2B").replace("~", "%7E")
    one = {"SPDXID": identifier("Package", package.name), "name": package.name, "versionInfo": package.version,
           "supplier": "Organization: Debian", "originator": originator(package.maintainer),
           "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
           "homepage": package.homepage or "NONE", "sourceInfo": f"built from Debian source {package.source} {package.source_version}",
           "licenseConcluded": "NOASSERTION", "licenseDeclared": licences.declared, "licenseComments": others,
           "copyrightText": "NOASSERTION", "comment": use_of(package),
           "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": purl}]}
    if entry and entry.get("anomaly"):
        one["annotations"] = [{"annotationDate": build_time(), "annotationType": "REVIEW", "annotator": "Organization: tubed developers",
                               "comment": f"{known['what']} {known['measure']}"} for known in entry["anomaly"]]
    return {key: value for key, value in one.items() if value != ""}


def originator(maintainer):
    words = re.match(r"(.*?)\s*<(.*)>", maintainer)
    return f"Organization: {words[1]} ({words[2]})" if words else "NOASSERTION"


def use_of(package):
    if package.is_compiled_in and not package.programs:
        return "compiled in"
    through = "" if package.direct else ", through other libraries"
    return f"{' '.join(sorted(package.sonames))}, loaded by {', '.join(sorted(package.programs))}{through}"


def relationships(ours, packages):
    main = identifier("Package", "tubed")
    for name, files in ours.items():
        yield {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": identifier("Package", name)}
        for file in files:
            yield {"spdxElementId": identifier("Package", name), "relationshipType": "CONTAINS", "relatedSpdxElement": file["SPDXID"]}
    for package in packages:
        kind = "STATIC_LINK" if package.is_compiled_in and not package.programs else "DYNAMIC_LINK" if package.direct else "DEPENDS_ON"
        yield {"spdxElementId": main, "relationshipType": kind, "relatedSpdxElement": identifier("Package", package.name)}


def spdx(version, trees, packages, entries):
    of_source = {source: entry for entry in entries for source in entry["source"]}
    licences = {package.name: licences_of(package.name) for package in packages}
    texts = {reference: text for one in licences.values() for reference, text in one.texts.items()}
    files_of = {name: our_files(name, tree) for name, tree in trees.items()}
    ours = {name: files for name, (files, _) in files_of.items()}
    document = {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"tubed-{version}",
        "creationInfo": {"created": build_time(), "creators": ["Organization: tubed developers", f"Tool: make_sbom.py-{version}"]},
        "packages": [our_package(name, version, *files_of[name]) for name in trees]
                    + [debian_package(one, licences[one.name], of_source.get(one.source)) for one in packages],
        "files": [file for files in ours.values() for file in files],
        "hasExtractedLicensingInfos": [{"licenseId": reference, "name": name, "extractedText": text}
                                       for reference, (name, text) in sorted(texts.items())],
        "relationships": list(relationships(ours, packages))}
    content = uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(document, sort_keys=True))
    return {**document, "documentNamespace": f"https://spdx.org/spdxdocs/tubed-{version}-{content}"}


def soup_text(version, packages, entries):
    """The list that IEC 62304 asks for in 8.1.2: title, manufacturer, version; and what we know of each."""
    lines = [f"# Software of unknown provenance in tubed {version}", "",
             "Made with the package from `systemd/package/soup.toml` and from what the installed programs load. Versions are Debian's.", "",
             "| title | manufacturer | version | source | we require of it |", "|---|---|---|---|---|"]
    for entry in entries:
        used = [package for package in packages if package.source in entry["source"]]
        versions = ", ".join(sorted({f"{package.name} {package.version}" for package in used}))
        sources = ", ".join(sorted({f"{package.source} {package.source_version}" for package in used}))
        lines.append(f"| {entry['title']} | {entry['manufacturer']} | {versions} | {sources} | {entry['requirement']} |")
    lines += ["", "## Anomalies that were looked at", "", "| of | anomaly | what we do about it | test |", "|---|---|---|---|"]
    for entry in entries:
        for known in entry.get("anomaly", ()):
            test = f"`{known['test']}`" if known.get("test") else "none"
            lines.append(f"| {entry['title']} | {known['what']} | {known['measure']} | {test} |")
        if not entry.get("anomaly"):
            lines.append(f"| {entry['title']} | none noted | | |")
    named = {source for entry in entries for source in entry["source"]}
    lines += ["", "## Loaded through these", "", "Nothing of ours calls them; their anomalies were not looked at one by one.", "",
              "| package | version | source | loaded by |", "|---|---|---|---|"]
    lines += [f"| {one.name} | {one.version} | {one.source} | {', '.join(sorted(one.programs))} |"
              for one in packages if one.source not in named]
    return "\n".join(lines) + "\n"


def main():
    version, soup, output, *named = sys.argv[1:]
    trees = dict(one.split("=", 1) for one in named)
    found = packages_loaded_by(trees.values())
    try:
        entries = read_soup(soup, found)
    except Incomplete as words:
        print(f"make_sbom.py: {words}", file=sys.stderr)
        return 1
    packages = [found[name] for name in sorted(found)]
    folder = pathlib.Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / OUTPUTS[0]).write_text(json.dumps(spdx(version, trees, packages, entries), indent=1, ensure_ascii=False) + "\n")
    (folder / OUTPUTS[1]).write_text(soup_text(version, packages, entries))
    print(f"{len(packages)} packages of others, {sum(1 for one in packages if one.direct or one.is_compiled_in)} of them used by us directly")
    return 0


if __name__ == "__main__":
    sys.exit(main())
