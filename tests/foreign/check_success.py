"""Fails when a suite of report.json is below a bar: check_success.py REPORT.json SUITE BAR"""
import json
import sys

path, suite, bar = sys.argv[1], sys.argv[2], float(sys.argv[3])
rows = [row for row in json.load(open(path))["results"] if row["suite"] == suite]
assert rows, f"{path}: no row of suite {suite}"
for row in rows:
    rate = row["success_rate"]
    print(f"{row['variant']} {suite} seed {row['seed']}: {row['successes']}/{row['episodes']} = {rate:.3f}")
    assert rate >= bar, f"{rate:.3f} is below {bar}"
