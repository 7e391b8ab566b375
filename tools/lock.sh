#!/usr/bin/env bash
# Resolve pyproject.toml into the lock files. They name packages, versions and digests, and no place to get them from.
set -euo pipefail
cd "$(dirname "$0")/.."
compile=("${VENV:-.venv}/lock/bin/pip-compile" --quiet --upgrade --strip-extras --allow-unsafe --no-header --no-annotate
  --no-emit-index-url --no-emit-find-links --no-emit-trusted-host)
"${compile[@]}" --generate-hashes -o requirements.lock pyproject.toml
"${compile[@]}" --generate-hashes -c requirements.lock --extra test -o requirements-test.lock pyproject.toml
"${compile[@]}" --generate-hashes -c requirements-test.lock --extra postgres -o requirements-postgres.lock pyproject.toml
# torch comes in builds for this and that accelerator, whose digests differ: this one is by version alone.
"${compile[@]}" -c requirements-test.lock --extra train -o requirements-train.lock pyproject.toml
sed -i -E -e 's/^(torch==[0-9.]+)\+.*/\1/' -e '/^#/d' -e '/^$/d' requirements*.lock
