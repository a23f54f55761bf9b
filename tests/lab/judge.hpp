// Determines what became of every report that a glove sent, from the samples that a client of posed
// received.
//
// A session is the time between two plugs. Within a session every report must arrive, in order and
// unmixed. Around a replug, reports are lost, but only those under way when the plug was drawn, and
// those that the kernel took before posed had opened the device and finished its start-up exchange.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/lab/devices.hpp"
#include "tests/lab/listener.hpp"

namespace posed::lab {

struct Replug {
  Moment unplugged, plugged;
  Moment node;  // when the kernel created the device's node
};

struct Verdict {
  std::uint64_t samples = 0;
  std::uint64_t mixed = 0;          // samples with raw values of more than one report, or of none
  std::uint64_t skipped = 0;        // missing reports within a session
  std::uint64_t gaps = 0;           // gaps in the stream's sequence numbers
  std::uint64_t ours = 0;           // sessions that lack, before their first report, one
                                    // that was sent after posed reported KIND_FOUND
  std::uint64_t cut_early = 0;      // sessions that lack more at their end than what was under way
  std::uint64_t lost_a_replug = 0;  // reports, at most
  std::chrono::steady_clock::duration back{};        // node to the client's first sample, at most
  std::chrono::steady_clock::duration since_plug{};  // plug to the same
  std::chrono::steady_clock::duration silence{};     // the longest between two samples of a session
  std::string problems;

  [[nodiscard]] bool good() const;
  [[nodiscard]] std::string text() const;
};

// `said[n]` is the time at which report n was sent; sensors hold n % `modulus`.
Verdict judge(const Received& received, const std::vector<Moment>& said, std::uint32_t modulus,
              const std::vector<Replug>& replugs);

}  // namespace posed::lab
