#pragma once

#include <filesystem>

#include "core/result.h"

namespace anchorsplat {

// Protects inputs: a command never overwrites a file that it reads, not under another name, through a symbolic or hard
// link, or as one of several outputs. While a record is open, opening a file for reading records its device and inode,
// and OutputFile checks them before it names a file. Verbs only declare early what they will read later, and which
// files are their own state.
//
// The program opens one record per verb; nested records join the outer one. Without a record nothing is recorded or
// refused. Each run has its own (core/run_context.h). All functions are thread-safe within a run.
class InputRecord {
 public:
  InputRecord();
  ~InputRecord();
  InputRecord(const InputRecord&) = delete;
  InputRecord& operator=(const InputRecord&) = delete;
};

// Records an input: an open descriptor, or the file of that name, if it exists. "-" is standard input. Files that the
// command wrote and its own files are ignored.
void RecordInput(int descriptor, const std::filesystem::path& name);
void RecordInput(const std::filesystem::path& path);

// Records a state file of the command from an earlier run: a checkpoint, a manifest, results to resume from, output of
// an interrupted run. It can be read and replaced even where overwriting is not allowed. An input does not become one.
void RecordOwnFile(const std::filesystem::path& path);
bool IsOwnFile(const std::filesystem::path& path);

// Records an output, so that reading it back does not make it an input.
void RecordWritten(int descriptor);

// kBadArgument: `output` is an input; `folder`, about to be removed, contains an input.
Status CheckNotInput(const std::filesystem::path& output);
Status CheckHoldsNoInput(const std::filesystem::path& folder);

}  // namespace anchorsplat
