# For scripts that drive headless Chromium; to be sourced: browser-tools.sh's `browser_tools NAME PACKAGE@VERSION…` installs the browser
# (Debian's) and the packages (npm's, into build/viewer-test) for `make NAME`, where they are missing, and exports CHROMIUM and NODE_FOLDER.
browser_tools() {
  local name=$1 missing=() package
  shift
  export CHROMIUM=${CHROMIUM:-/usr/bin/chromium} NODE_FOLDER=$PWD/build/viewer-test
  scripts/install-missing.sh "$name" "$CHROMIUM=chromium" node=nodejs npm=npm
  mkdir -p "$NODE_FOLDER"
  for package in "$@"; do
    [ -d "$NODE_FOLDER/node_modules/${package%@*}" ] || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  [ -f "$NODE_FOLDER/package.json" ] || echo '{"private": true}' >"$NODE_FOLDER/package.json"
  npm install --prefix "$NODE_FOLDER" --no-audit --no-fund --silent "${missing[@]}"
}
