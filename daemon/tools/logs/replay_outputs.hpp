// What `posed replay` does with the frames of a replay, what it reports of a log, and what the log
// lacks. Cold.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "daemon/pipeline/messages.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/replay/broadcast.hpp"
#include "daemon/tools/replay/expectation.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/log/reader.hpp"
#include "proto/message/frame_message.hpp"

namespace posed::tools {

// FRAMES.bin: repeated {u32 little-endian length, posed.v1.Frame}, in pipeline order, stage stamps
// unset.
class FrameFile {
 public:
  static Result<FrameFile> create(const std::filesystem::path& path);

  void add(const v1::Frame& frame);
  // Gives the file its name, if everything was written. Without it there is no file, or the old
  // one.
  Result<> close() { return file_.keep(); }

 private:
  explicit FrameFile(WholeFile file) : file_(std::move(file)) {}

  WholeFile file_;
  std::string bytes_;
};

// What became of a log that was replayed and compared.
struct ReplayOutcome {
  std::uint64_t frames = 0, raw_frames = 0;
  replay::Expectation::Counts counts{};
  std::string isa{};      // on which it was replayed
  std::string problem{};  // empty: all as published
  std::vector<std::string> missing{};
  double took_s = 0.0;
};

// One log has the same keys as each of several.
[[nodiscard]] Findings findings_of(const std::string& log, const std::string& recorded_isa,
                                   const ReplayOutcome& outcome);

// The outputs for the frames of a replay: the file, the comparison, the network. And the
// instruction set on which a log is replayed.
class ReplayOutputs {
 public:
  explicit ReplayOutputs(const replay::Replay& replay);

  void add(const pipeline::Item& item);

  // Call after the last frame.
  Result<> finish();

  std::optional<FrameFile> file;
  std::optional<replay::Expectation> expectation;
  std::unique_ptr<replay::Broadcast> broadcast;
  std::optional<Error> difference;
  std::uint64_t frames = 0;
  std::uint64_t raw_frames = 0;  // of them: the input before styling, which `record` does not count

 private:
  const replay::Replay& replay_;
  std::vector<std::array<message::FrameEncoder, 2>> encoders_;  // styled, raw
};

// What the log says that it was recorded on; "auto" if it says nothing.
[[nodiscard]] std::string recorded_isa(const log::Reader& reader);

// Uses `wanted`; if it is empty, `recorded`, or the CPU's best where the CPU lacks that. For the
// whole process.
Result<> set_isa_or(const std::string& wanted, const std::string& recorded);

// What a replay cannot repeat, because the log does not hold it: one sentence for each gap, for
// each body without a description and for each source without a stream.
[[nodiscard]] std::vector<std::string> missing_from(const log::Reader& reader,
                                                    const replay::Replay& replay);

// The report of compared logs in JUnit's XML, which GitHub, GitLab and Jenkins show as test cases:
// one log as a test case. Schema: https://github.com/testmoapp/junitxml.
struct JUnitCase {
  std::string name;  // the log's path
  double took_s = 0.0;
  std::string problem;  // why it failed; empty: it passed
};

// Replaces the file at `path` by one suite named "posed replay" with these cases. Text that XML 1.0
// cannot hold is replaced by '?'.
Result<> write_junit(const std::filesystem::path& path, std::span<const JUnitCase> cases);

}  // namespace posed::tools
