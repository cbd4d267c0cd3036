"""Publishes to a server that speaks S3 and looks at it with boto3: s3_check.py NTP DATASET WORK_DIR"""
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import boto3

ntp, dataset, work = sys.argv[1], sys.argv[2], Path(sys.argv[3])
client = boto3.client("s3", endpoint_url=os.environ["AWS_ENDPOINT"], region_name="us-east-1")
for bucket in ["robots", "careless"]:
    client.create_bucket(Bucket=bucket)
WORDS = ["--license", "cc-by-4.0", "--date", "2026-01-01", "--json"]


def run(*words, code=0):
    found = subprocess.run([ntp, *words], capture_output=True, text=True)
    assert found.returncode == code, (words, found.returncode, found.stdout, found.stderr)
    return found


def objects(bucket, prefix):
    pages = client.get_paginator("list_objects_v2").paginate(Bucket=bucket, Prefix=prefix)
    return {item["Key"].removeprefix(prefix): item["Size"] for page in pages for item in page.get("Contents", [])}


def content(key):
    return client.get_object(Bucket="robots", Key=key)["Body"].read()


# Killed at several moments, then carried on.
url = "s3://robots/data/towers"
for delay in [0.05, 0.1, 0.2, 0.4]:
    process = subprocess.Popen([ntp, "publish", dataset, "--to", url, *WORDS], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(delay)
    process.send_signal(signal.SIGKILL)
    process.wait()
summary = json.loads(run("publish", dataset, "--to", url, *WORDS).stdout)
found = objects("robots", "data/towers/")
sums = dict(reversed(line.split("  ")) for line in content("data/towers/SHA256SUMS").decode().splitlines())
assert set(found) == {*sums, "SHA256SUMS"} and len(found) == summary["files"], (found, sums)
for name, expected in sums.items():
    assert hashlib.sha256(content(f"data/towers/{name}")).hexdigest() == expected, name
again = json.loads(run("publish", dataset, "--to", url, *WORDS).stdout)
assert (again["copied"], again["kept"]) == (0, summary["files"]), again
assert json.loads(run("verify", url, "--json").stdout) == {"files": len(sums), "differences": []}

# The same files as in a folder.
folder = work / "published"
run("publish", dataset, "--to", str(folder), *WORDS)
assert (folder / "SHA256SUMS").read_bytes() == content("data/towers/SHA256SUMS")

# What is changed is found, and never overwritten.
client.put_object(Bucket="robots", Key="data/towers/meta/info.json", Body=b"{}")
client.delete_object(Bucket="robots", Key="data/towers/ntp/info.json")
verified = json.loads(run("verify", url, "--json", code=1).stdout)
kinds = {difference["path"]: difference["difference"] for difference in verified["differences"]}
assert kinds == {"meta/info.json": "changed", "ntp/info.json": "missing"}, kinds
refused = run("publish", dataset, "--to", url, *WORDS, code=1).stderr
assert "meta/info.json" in refused and "nothing is overwritten" in refused, refused

# A store that passes over conditions, and one that is not there.
refused = run("publish", dataset, "--to", "s3://careless/towers", *WORDS, code=1).stderr
assert "conditional writes" in refused and objects("careless", "") == {}, refused
refused = run("verify", "s3://nowhere/towers", code=1).stderr
assert "s3://nowhere/towers" in refused, refused
megabytes = sum(found.values()) / 1e6
print(f"S3 (moto): {len(found)} objects, {megabytes:.1f} MB, as in a folder; killed, carried on, verified, refused by name")
