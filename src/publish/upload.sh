#!/bin/sh
# Brings this folder to the Hugging Face hub: sh upload.sh OWNER/NAME
# Needs the hub's client (pip install huggingface_hub) and a login (hf auth login). Interrupted, the same command goes on.
# LeRobot opens a dataset on the hub only when the repository has a tag that names the format's version.
# With git alone: git init, git lfs install, git add, git commit, git tag VERSION, git push ORIGIN main VERSION,
# with VERSION the codebase_version of meta/info.json
set -eu
repository=${1:?"the repository is missing: sh upload.sh OWNER/NAME"}
cd -- "$(dirname -- "$0")"
version=$(sed -n 's/.*"codebase_version": *"\([^"]*\)".*/\1/p' meta/info.json)
if command -v sha256sum > /dev/null; then sha256sum --quiet -c SHA256SUMS; fi
hf upload "$repository" . . --repo-type dataset
hf repos tag create "$repository" "$version" --repo-type dataset
echo "published: https://huggingface.co/datasets/$repository at $version"
