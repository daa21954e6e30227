#!/usr/bin/env python3
"""The configuration a new installation begins with: the sample (standard input) with real-time priorities.

What delivers to others runs before what computes: a measurement is never kept waiting by a solution.
"""
import re
import sys

PRIORITIES = {"em_acquisition": 60, "image_grab": 55, "publisher": 52, "optimizer": 50, "frangi": 45}

text = sys.stdin.read()
for stage, priority in PRIORITIES.items():
    text, found = re.subn(rf"(\[realtime\.{stage}\]\n(?:#.*\n)*priority = )\d+", rf"\g<1>{priority}", text)
    if found != 1:
        sys.exit(f"start_configuration.py: no [realtime.{stage}] priority in the sample")
sys.stdout.write(text)
