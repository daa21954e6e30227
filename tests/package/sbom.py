"""What the package says it consists of, against what it is: sbom.py PACKAGES, or sbom.py --self-test.

The form is SPDX 2.3's (its JSON schema's required fields and the rules of its text); the content is compared with the files in
the package and with what the dynamic linker loads for its programs.
"""
import copy
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

from packages import Failure, Unpacked, check

LICENCE_WORD = re.compile(r"(NOASSERTION|NONE|LicenseRef-[A-Za-z0-9.-]+|[A-Za-z0-9][A-Za-z0-9.+-]*)$")
AGENT = re.compile(r"(NOASSERTION|(Organization|Person): .+|Tool: [^ ]+)$")
RELATIONSHIPS = {"DESCRIBES", "CONTAINS", "DYNAMIC_LINK", "STATIC_LINK", "DEPENDS_ON"}
TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
IDENTIFIER = re.compile(r"SPDXRef-[A-Za-z0-9.-]+$")
REQUIRED = {
    "document": {"spdxVersion", "dataLicense", "SPDXID", "name", "documentNamespace", "creationInfo", "packages", "relationships"},
    "package": {"SPDXID", "name", "downloadLocation", "versionInfo", "licenseDeclared", "licenseConcluded", "copyrightText", "supplier"},
    "file": {"SPDXID", "fileName", "checksums"},
    "relationship": {"spdxElementId", "relationshipType", "relatedSpdxElement"},
    "licence": {"licenseId", "extractedText"},
    "annotation": {"annotationDate", "annotationType", "annotator", "comment"},
}


def lacking(kind, thing):
    return [f"{kind} {thing.get('SPDXID', thing.get('name', '?'))} lacks {field}" for field in sorted(REQUIRED[kind] - thing.keys())]


def licences_in(expression):
    return [word for word in re.split(r"[()\s]+", expression) if word and word not in ("AND", "OR", "WITH")]


def faults_of_packages(packages, known_licences):
    for package in packages:
        yield from lacking("package", package)
        for field in ("licenseDeclared", "licenseConcluded"):
            for word in licences_in(package.get(field, "")):
                if not LICENCE_WORD.match(word) or (word.startswith("LicenseRef-") and word not in known_licences):
                    yield f"{package['name']}: {field} has {word}, which is no licence of SPDX or of the document"
        for field in ("supplier", "originator"):
            if field in package and not AGENT.match(package[field]):
                yield f"{package['name']}: {field} is {package[field]!r}"
        if not package.get("filesAnalyzed", True) and ("packageVerificationCode" in package or "hasFiles" in package):
            yield f"{package['name']} has files without having looked at them"
        for annotation in package.get("annotations", ()):
            yield from lacking("annotation", annotation)
            if annotation.get("annotationType") not in ("REVIEW", "OTHER") or not TIME.match(annotation.get("annotationDate", "")):
                yield f"{package['name']}: annotation {annotation}"


def faults_of_identifiers(document):
    things = [document, *document.get("packages", ()), *document.get("files", ())]
    names = [thing.get("SPDXID", "") for thing in things]
    yield from (f"{name!r} is no identifier" for name in names if not IDENTIFIER.match(name))
    yield from (f"{name} is there twice" for name in {name for name in names if names.count(name) > 1})
    for one in document.get("relationships", ()):
        yield from lacking("relationship", one)
        if one.get("relationshipType") not in RELATIONSHIPS:
            yield f"relationship of the kind {one.get('relationshipType')}"
        yield from (f"a relationship names {end}, which is not there" for end in (one.get("spdxElementId"), one.get("relatedSpdxElement"))
                    if end not in names)
    if not any(one.get("relationshipType") == "DESCRIBES" for one in document.get("relationships", ())):
        yield "the document describes nothing"


def faults_of(document):
    """What is wrong with the form, in words."""
    faults = lacking("document", document)
    if document.get("spdxVersion") != "SPDX-2.3" or document.get("dataLicense") != "CC0-1.0" or document.get("SPDXID") != "SPDXRef-DOCUMENT":
        faults.append("not SPDX 2.3 under CC0-1.0")
    if not re.match(r"https?://[^#\s]+$", document.get("documentNamespace", "")):
        faults.append("documentNamespace is no URI")
    creation = document.get("creationInfo", {})
    if not TIME.match(creation.get("created", "")) or not creation.get("creators") or \
            not all(AGENT.match(one) for one in creation["creators"]):
        faults.append(f"creationInfo is {creation}")
    for licence in document.get("hasExtractedLicensingInfos", ()):
        faults += lacking("licence", licence)
    for file in document.get("files", ()):
        faults += lacking("file", file)
        if "SHA1" not in {one["algorithm"] for one in file.get("checksums", ())}:
            faults.append(f"{file.get('fileName')} has no SHA1")
    known = {licence.get("licenseId") for licence in document.get("hasExtractedLicensingInfos", ())}
    return faults + list(faults_of_packages(document.get("packages", ()), known)) + list(faults_of_identifiers(document))


def faults_of_files(document, trees):
    """The files of each tree are those of the document, with their sums."""
    files = {file["SPDXID"]: file for file in document["files"]}
    for package in (one for one in document["packages"] if one.get("filesAnalyzed", True)):
        tree, own = trees[package["name"]], [files[identifier] for identifier in package["hasFiles"]]
        excluded = package["packageVerificationCode"]["packageVerificationCodeExcludedFiles"]
        there = {f"./{path.relative_to(tree)}" for path in tree.rglob("*") if path.is_file() and not path.is_symlink()} - set(excluded)
        yield from (f"{package['name']}: {name} is not in both package and document" for name in there ^ {file["fileName"] for file in own})
        for file in own:
            content = (tree / file["fileName"]).read_bytes() if file["fileName"] in there else b""
            for one in file["checksums"]:
                if hashlib.new(one["algorithm"], content).hexdigest() != one["checksumValue"]:
                    yield f"{package['name']}: {file['fileName']} has another {one['algorithm']}"
        sums = sorted(one["checksumValue"] for file in own for one in file["checksums"] if one["algorithm"] == "SHA1")
        if package["packageVerificationCode"]["packageVerificationCodeValue"] != hashlib.sha1("".join(sums).encode()).hexdigest():
            yield f"{package['name']}: wrong verification code"


def libraries_of(program):
    """{soname: real path}, asked of the dynamic linker itself."""
    listed = subprocess.run([str(program)], env={**os.environ, "LD_TRACE_LOADED_OBJECTS": "1"}, capture_output=True, text=True, check=True)
    return {soname: os.path.realpath(path) for soname, path in re.findall(r"^\s*(\S+) => (/\S+)", listed.stdout, re.MULTILINE)}


def faults_of_libraries(document, programs):
    """Every library that a program loads is in the document, with the version that is installed."""
    said = {soname.rstrip(",") for package in document["packages"] for soname in package.get("comment", "").split(", loaded by")[0].split()}
    for program in programs:
        yield from (f"{program.name} loads {soname}, of which the document says nothing" for soname in set(libraries_of(program)) - said)
    for package in (one for one in document["packages"] if not one.get("filesAnalyzed", True)):
        installed = subprocess.run(["dpkg-query", "-W", "-f=${Version}\n", package["name"]], capture_output=True, text=True, check=False)
        if package["versionInfo"] not in installed.stdout.split():
            yield f"{package['name']} {package['versionInfo']} is not what is installed"


def check_packages(packages):
    with Unpacked(packages) as trees:
        documents = trees["tubed"] / "usr/share/doc/tubed"
        document, soup = json.loads((documents / "tubed.spdx.json").read_text()), (documents / "SOUP.md").read_text()
        programs = [trees["tubed"] / name for name in ("usr/sbin/tubed", "usr/bin/tubectl", "usr/bin/tubed-exporter", "usr/bin/tubed-view")]
        faults = [*faults_of(document), *faults_of_files(document, trees), *faults_of_libraries(document, programs)]
        check(not faults, "\n".join(faults))
        daemon = libraries_of(programs[0])
        check(len(daemon) > 10 and not any("opencv" in soname or "gdal" in soname for soname in daemon), f"the daemon loads {sorted(daemon)}")
        readers = {soname for program in programs for soname in libraries_of(program) if "imgcodecs" in soname or "gdal" in soname}
        check(not readers, f"a program loads OpenCV's image readers: {sorted(readers)}")
        imports = subprocess.run(["readelf", "--dyn-syms", "-W", daemon["libddsc.so.0debian"]], capture_output=True, text=True, check=True)
        check("__assert_fail" not in imports.stdout, "Cyclone DDS was built with assertions, which packets can fail: see soup.toml")
        for title in ("Eclipse Cyclone DDS", "OpenCV", "GNU C library"):
            check(re.search(rf"^\| {title} \| [^|]+ \| [^|]*\d[^|]* \|", soup, re.MULTILINE), f"SOUP.md has no row of {title}")
        print(f"{len(document['packages'])} packages, {len(document['files'])} files, {len(document['relationships'])} relationships; "
              f"the daemon loads {len(daemon)} libraries")


GOOD = {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": "a", "documentNamespace": "https://a/b",
        "creationInfo": {"created": "2026-11-21T08:00:00Z", "creators": ["Tool: a-1"]},
        "hasExtractedLicensingInfos": [{"licenseId": "LicenseRef-a", "extractedText": "a"}],
        "files": [{"SPDXID": "SPDXRef-File-a", "fileName": "./a", "checksums": [{"algorithm": "SHA1", "checksumValue": "0"}]}],
        "packages": [{"SPDXID": "SPDXRef-Package-a", "name": "a", "downloadLocation": "NONE", "versionInfo": "1", "filesAnalyzed": False,
                      "licenseDeclared": "(MIT OR LicenseRef-a)", "licenseConcluded": "NOASSERTION", "copyrightText": "NONE",
                      "supplier": "Organization: a"}],
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": "SPDXRef-Package-a"}]}
WRONG = ("document.pop('creationInfo')", "document.update(spdxVersion='SPDX-2.2')", "document.update(documentNamespace='a b')",
         "document['creationInfo'].update(created='today')", "document['packages'][0].pop('downloadLocation')",
         "document['packages'][0].update(licenseDeclared='LicenseRef-unknown')", "document['packages'][0].update(supplier='somebody')",
         "document['packages'][0].update(hasFiles=['SPDXRef-File-a'])", "document['files'][0].update(SPDXID='SPDXRef-Package-a')",
         "document['files'][0].update(checksums=[])", "document['relationships'][0].update(relatedSpdxElement='SPDXRef-nothing')",
         "document['relationships'].clear()", "document['hasExtractedLicensingInfos'][0].pop('extractedText')")


def self_test():
    check(faults_of(GOOD) == [], f"a good document is refused: {faults_of(GOOD)}")
    for change in WRONG:
        document = copy.deepcopy(GOOD)
        exec(change, {"document": document})
        check(faults_of(document), f"not found: {change}")
    print(f"all of {len(WRONG)} wrong documents were found")


def main():
    try:
        self_test() if sys.argv[1] == "--self-test" else check_packages(sys.argv[1])
    except Failure as failure:
        print(f"FAILED: {failure}")
        return 1
    return 0


sys.exit(main())
