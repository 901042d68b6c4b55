#pragma once

#include <filesystem>

#include "core/result.h"

namespace anchorsplat {

// What a command reads is never what it writes: neither by another name, nor through a symbolic or a hard link, nor as
// one of several files that it writes. While a record is open, whatever opens a file for reading puts it down here by
// device and inode, and OutputFile looks here before it gives a file its name. Both do it by themselves; verbs only say
// early what they will read later, and what is their own.
//
// The program opens one record for its verb. Records within a record are part of it. Without one nothing is put down
// and nothing refused. Every run has its own (core/run_context.h). All functions may be called from any thread that
// takes part in it.
class InputRecord {
 public:
  InputRecord();
  ~InputRecord();
  InputRecord(const InputRecord&) = delete;
  InputRecord& operator=(const InputRecord&) = delete;
};

// An input: what is open there, or what has that name (nothing, where there is no such file). "-" is standard input.
// Files that the command wrote itself are none, and neither are its own ones.
void RecordInput(int descriptor, const std::filesystem::path& name);
void RecordInput(const std::filesystem::path& path);

// State that belongs to the command, left there by an earlier run of it: a checkpoint, a manifest, results to go on
// from, what an interruption wrote. It may be read and replaced, also where nothing else may be overwritten. An input
// does not become one.
void RecordOwnFile(const std::filesystem::path& path);
bool IsOwnFile(const std::filesystem::path& path);

// A file that the command has just written: reading it back does not make it an input.
void RecordWritten(int descriptor);

// Errors (kBadArgument): there is an input under this name; a folder with an input in it, which is not to be removed.
Status CheckIsNoInput(const std::filesystem::path& output);
Status CheckHoldsNoInput(const std::filesystem::path& folder);

}  // namespace anchorsplat
