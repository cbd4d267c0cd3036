"""Has lerobot-doctor look at a dataset: doctor_reads.py DATASET DOCTOR"""
import collections
import json
import subprocess
import sys
from pathlib import Path

dataset, doctor = Path(sys.argv[1]), sys.argv[2]
found = subprocess.run([doctor, "check", str(dataset), "--json"], capture_output=True, text=True)
report = json.loads(found.stdout)
info = json.loads((dataset / "meta/info.json").read_text())
kinds = collections.Counter(check["severity"].lower() for check in report["checks"])
if kinds["fail"]:
    sys.exit(found.stdout)
assert (report["total_episodes"], report["total_frames"]) == (info["total_episodes"], info["total_frames"]), report
told = ", ".join(f"{kinds[kind]} {kind}" for kind in ["pass", "warn", "fail"])
counts = f"{report['total_episodes']} episodes, {report['total_frames']} frames"
print(f"lerobot-doctor {report['version']}: opened, {counts}, {told}")
