#!/usr/bin/env bash
# The browser tests need a Chromium. Debian's headless shell takes half the processor time of the whole browser, so it
# comes first: install it where that is possible; else any Chromium will do, else say what is missing.
set -euo pipefail
if command -v chromium-headless-shell >/dev/null; then exit 0; fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  export DEBIAN_FRONTEND=noninteractive
  apt-get update -qq || true
  for package in chromium-headless-shell chromium; do
    if apt-get install -y -qq --no-install-recommends "$package" >/dev/null; then exit 0; fi
  done
fi
for name in chromium chromium-browser google-chrome; do
  if command -v "$name" >/dev/null; then exit 0; fi
done
echo "Missing: chromium-headless-shell or chromium (Debian: sudo apt-get install chromium-headless-shell)" >&2
exit 1
