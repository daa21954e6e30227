"""Every quantity of the contract says its unit: check_units.py IDL_FOLDER, or check_units.py --self-test.

A real number's or a time's name ends in its unit (_mm, _rad, _ns, _hz, ...) and @unit says the same, so that neither a person
nor a program takes millimetres for metres. Numbers without a unit are named in UNITLESS.
"""
import pathlib
import re
import sys

UNIT_OF_SUFFIX = {"mm": "mm", "mm2": "mm^2", "rad": "rad", "deg": "deg", "ns": "ns", "us": "us", "ms": "ms", "s": "s", "hz": "Hz", "px": "px",
                  "bytes": "bytes", "percent": "percent"}
# Of the transforms the last column is in mm, as their comment says, and the rest has no unit: @unit cannot say both.
UNITLESS = {"tangent_world", "tangent_em", "indicator", "image_inlier_ratio", "in_view_ratio", "distortion", "T_world_em", "T_camera_world",
            "probability", "as_stated", "magnification"}
SAY_IT_BY_UNIT_ALONE = {"width", "height"}
MEMBER = re.compile(r'^\s*(?:@key\s+)?(?:@unit\("([^"]+)"\)\s+)?((?:unsigned )?(?:long long|long|short)|double|float|octet)\s+(\w+)\s*(?:\[[^;]*)?;',
                    re.MULTILINE)


def faults_of(name, text):
    for unit, kind, member in MEMBER.findall(text):
        suffix = member.rsplit("_", 1)[-1] if "_" in member else ""
        expected = UNIT_OF_SUFFIX.get(suffix)
        if expected and unit != expected:
            yield f"{name}: {member} has {'the unit ' + unit if unit else 'no @unit'}, its name says {expected}"
        elif unit and not expected and member not in SAY_IT_BY_UNIT_ALONE:
            yield f"{name}: {member} is in {unit}, which its name does not say"
        elif kind in ("double", "float") and not unit and member not in UNITLESS:
            yield f"{name}: {member} has no unit, neither in its name nor as @unit"


def self_test():
    good = '@unit("mm") double p_world_mm[3];\nfloat tangent_world[3];\nunsigned long count;\n@unit("ns") long long age_ns;\n'
    wrong = ("double p_world_mm[3];\n", '@unit("m") double p_world_mm[3];\n', "double p_world[3];\n", '@unit("mm") double p_world[3];\n',
             "long long age_ns;\n")
    found = [list(faults_of("text", text)) for text in (good, *wrong)]
    assert not found[0] and all(found[1:]), found
    print(f"all of {len(wrong)} wrong members were found")


def main():
    if sys.argv[1] == "--self-test":
        self_test()
        return 0
    files = sorted(pathlib.Path(sys.argv[1]).glob("*.idl"))
    faults = [fault for file in files for fault in faults_of(file.name, file.read_text())]
    count = sum(len(MEMBER.findall(file.read_text())) for file in files)
    print("\n".join(faults) if faults else f"{count} numbers in {len(files)} files")
    return 1 if faults or not files else 0


sys.exit(main())
