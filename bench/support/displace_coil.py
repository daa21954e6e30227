#!/usr/bin/env python3
"""A sequence folder in which a coil is measured beside where it is: somebody has bent the catheter there, or metal lies beside it.
Or all of them: the tracker's field has changed, or the patient was moved against it.

  displace_coil.py FROM TO SENSOR X Y Z [BEGIN [END]]

SENSOR counts from 1 at the tip, or is "all". Everything of FROM but em.csv is linked. X, Y, Z: mm in the tracker's frame; BEGIN, END: seconds (default: the whole of it).
"""
import csv
import pathlib
import sys


def displaced(row, sensor, way_mm, begin_s, end_s):
    if sensor not in (row["sensor"], "all") or not row["x"] or not begin_s <= float(row["t_s"]) < end_s:
        return row
    return {**row, **{axis: repr(float(row[axis]) + mm) for axis, mm in zip("xyz", way_mm)}}


def main(source, target, sensor, *numbers):
    way_mm = [float(number) for number in numbers[:3]]
    begin_s, end_s = (*(float(number) for number in numbers[3:]), *(0, float("inf"))[len(numbers) - 3:])
    source, target = pathlib.Path(source).resolve(), pathlib.Path(target)
    target.mkdir()
    for entry in source.iterdir():
        if entry.name != "em.csv":
            (target / entry.name).symlink_to(entry)
    with open(source / "em.csv", newline="", encoding="utf-8") as lines, open(target / "em.csv", "w", newline="", encoding="utf-8") as out:
        rows = csv.DictReader(lines)
        written = csv.DictWriter(out, rows.fieldnames, lineterminator="\n")
        written.writeheader()
        written.writerows(displaced(row, sensor, way_mm, begin_s, end_s) for row in rows)


if __name__ == "__main__":
    if not 7 <= len(sys.argv) <= 9:
        sys.exit(__doc__)
    main(*sys.argv[1:])
