"""Validates a published folder's croissant.json and reads every record set of it: croissant_reads.py FOLDER"""
import itertools
import json
import sys
from importlib.metadata import version
from pathlib import Path

import mlcroissant
import pyarrow.parquet

root = Path(sys.argv[1])
dataset = mlcroissant.Dataset(jsonld=root / "croissant.json")
issues = dataset.metadata.ctx.issues
assert not issues.errors, issues.report()
declared = json.loads((root / "croissant.json").read_text())
told = []
for record_set in declared["recordSet"]:
    name = record_set["name"]
    if name == "splits":
        records = list(dataset.records(name))
        assert len(records) == len(record_set["data"]), records
        continue
    pattern = next(part["includes"] for part in declared["distribution"] if part["@id"] == f"{name}-files")
    rows = sum(pyarrow.parquet.read_metadata(file).num_rows for file in root.glob(pattern))
    # Reading a record takes Python a tenth of a millisecond and more, so of long tables the beginning is read.
    wanted = min(rows, 2000)
    records = list(itertools.islice(dataset.records(name), wanted))
    assert len(records) == wanted, (name, len(records), wanted)
    assert len(records[0]) == len(record_set["field"]), (name, records[0].keys())
    told.append(f"{wanted} of {rows} {name}" if wanted < rows else f"{rows} {name}")
if issues.warnings:
    told.append(issues.report())
print(f"mlcroissant {version('mlcroissant')}: validates, opened, {', '.join(told)}")
