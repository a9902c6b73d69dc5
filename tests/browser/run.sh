#!/bin/sh
# Draws the gallery of ndof-report and opens it (and any page given as argument) in headless Chromium.
#   tests/browser/run.sh [PAGE.html…]
# Installs playwright-core from the lock file and, where there is no Chromium, the one that it brings.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out="${CARGO_TARGET_DIR:-$root/target}/browser"
mkdir -p "$out"
cargo run --quiet --release --manifest-path "$root/Cargo.toml" -p ndof-report --example gallery "$out/gallery.html"
modules="$out/node"
mkdir -p "$modules"
cp "$here/package.json" "$here/package-lock.json" "$here/report.mjs" "$modules/"
npm ci --prefix "$modules" --no-audit --no-fund --silent
if ! command -v chromium >/dev/null && ! command -v google-chrome >/dev/null && [ -z "${CHROMIUM:-}" ]; then
  (cd "$modules" && npx playwright-core install --with-deps chromium-headless-shell)
fi
node "$modules/report.mjs" "$out/gallery.html" "$@" --screenshots "$out/screenshots"
