#!/bin/sh
# Bundles the libraries of the report page into vendor.min.js: one classic script that sets the global `vendor`.
# Needs Node.js with npm. Versions are fixed in package.json; package-lock.json fixes what they depend on.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$here/package.json" "$here/package-lock.json" "$here/vendor.js" "$work/"
cd "$work"
npm ci --no-audit --no-fund --silent
# es2020: every browser since 2020. The notices that the licences ask for are put in front, below.
npx esbuild vendor.js --bundle --minify --format=iife --global-name=vendor --target=es2020 \
  --legal-comments=none --charset=utf8 --metafile=meta.json --log-level=warning --outfile=vendor.min.js
node "$here/licenses.mjs" "$work" > LICENSES.txt
# The licences want their text wherever the code goes, so it travels inside the bundle, and with it inside every page.
{ echo '/*!'; cat LICENSES.txt; echo '*/'; cat vendor.min.js; } > "$here/vendor.min.js"
cp LICENSES.txt "$here/"
wc -c "$here/vendor.min.js" "$here/LICENSES.txt"
