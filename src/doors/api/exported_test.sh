#!/usr/bin/env bash
# What the shared library exports: the functions of the public headers, and nothing of what is inside.
#   exported_test.sh LIBRARY NM
set -uo pipefail
library=$1 nm=$2
names=$("$nm" -D --defined-only -C "$library" | sed -E 's/^[0-9a-f]* *[A-Za-z] //')
failed=0
for name in 'anchorsplat::ReadSplat(' 'anchorsplat::WriteSplatBytes(' 'anchorsplat::Splat::view(' 'anchorsplat::Enhance('; do
  grep -qF "$name" <<<"$names" || { echo "not exported: $name"; failed=1; }
done
if grep -vE '^anchorsplat::' <<<"$names" | grep -v '^$'; then
  echo "these are not the library's own"
  failed=1
fi
if grep -E 'GaussianCloud|CloudView|anchorsplat::internal|Result<|EnhanceOptions|OutputFile' <<<"$names"; then
  echo "these belong inside"
  failed=1
fi
echo "$(wc -l <<<"$names") exported names"
exit "$failed"
