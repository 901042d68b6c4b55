#!/usr/bin/env bash
# std::filesystem throws for a name that is too long or links that lead in a circle, and a user who mistyped is told to
# report a bug. So: its functions only with an error code, or through core/file_system.h. Tests may throw.
set -euo pipefail
cd "$(dirname "$0")/.."
find src -name '*.h' -o -name '*.cc' | grep -vE '(_test\.(h|cc)|_for_test\.h|/fuzz/.*)$' | sort |
  xargs perl -0777 -ne '
    my $call = qr/(?:absolute|canonical|weakly_canonical|relative|proximate|copy\w*|create_\w+|current_path|equivalent|
                     exists|file_size|hard_link_count|is_\w+|last_write_time|permissions|read_symlink|remove\w*|rename|
                     resize_file|space|status|symlink_status|temp_directory_path|(?:recursive_)?directory_iterator)/x;
    while (/\b(?:fs|filesystem)::($call)(?:\s+\w+)?(\((?:[^()]++|(?2))*\))|->((?:is_(?:regular_file|directory|symlink)|file_size)\(\))/g) {
      my ($name, $arguments) = ($1 // $3, $2 // "");
      next if $arguments =~ /\b(?:code|error|failed|ignored|unknown)\)$/;
      my $line = 1 + (substr($_, 0, $-[0]) =~ tr/\n//);
      print "$ARGV:$line: $name without an error code: see core/file_system.h\n";
      $bad = 1;
    }
    END { exit($bad // 0) }'
