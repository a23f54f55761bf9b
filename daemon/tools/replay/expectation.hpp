// Expectation checks that a replay gives, bit for bit, what the live run published. It compares
// each frame with the one in the log and stops at the first difference. Cold.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"

namespace posed::replay {

// "rotation_xyzw[17]: 0.5 live, 0.25 replayed", for the first field in the schema's order whose
// bits differ; empty if none does.
[[nodiscard]] std::string first_difference(const v1::Frame& live, const v1::Frame& replayed);

class Expectation {
 public:
  // The reader outlives it. For a log without frames the error says how to record one with frames.
  static Result<Expectation> open(const log::Reader& reader);

  // Compares the next frame of the replay. Streams are numbered as in Replay; `broken_at` is
  // Replay::broken_at() of the stream. The error at the first difference names stream, sequence and
  // field.
  Result<> compare(std::uint32_t stream, bool raw, const v1::Frame& replayed,
                   std::optional<std::uint64_t> broken_at);
  // Call after the replay: an error if a published frame was not replayed.
  Result<> finish(std::uint32_t stream, std::optional<std::uint64_t> broken_at);
  // Call after all streams have finished: an error if not one frame could be compared.
  Result<> check_compared() const;

  struct Counts {
    std::uint64_t compared = 0;
    std::uint64_t lost = 0;  // replayed, but according to the log it lacks them
    // not comparable, because the log lacks chunks or decisions before them
    std::uint64_t after_gap = 0;
    // replayed, but after the last frame in the log (recording was killed)
    std::uint64_t past_end = 0;

    Counts& operator+=(const Counts& other);
    // "2 frames that the log lacks, 40 after a gap, 0 past its end"; empty if there are none.
    [[nodiscard]] std::string not_compared() const;
  };
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  struct Channel {
    log::Reader::Frames frames;
    std::optional<v1::Frame> live;  // the next one; empty after the last
    std::string difference;         // between `live` and a replayed frame of the same sequence
    std::uint64_t after_gap = 0;    // replayed ones
  };
  struct Stream {
    std::string name;
    std::array<std::optional<Channel>, 2> channels;  // styled, raw
    std::uint64_t may_lack = 0;  // missing frames that the log's gap rows account for
  };
  explicit Expectation(std::string file) : file_(std::move(file)) {}
  [[nodiscard]] static std::string how_it_lacks(const Channel& channel);
  Result<> advance(Channel& channel) const;
  Result<> differs(const Stream& stream, bool raw, std::uint64_t sequence,
                   const std::string& how) const;

  std::string file_;
  std::vector<Stream> streams_;
  Counts counts_;
};

}  // namespace posed::replay
