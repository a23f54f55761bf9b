// What became of every report that a glove said, told from what a client of posed has heard.
//
// A session is what comes between two plugs. Within one, every report must come, in order and
// unmixed. Around a replug reports are lost, but only these: what was under way when the plug was
// drawn, and what the kernel took before posed had the device and its start-up talk was over.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/lab/devices.hpp"
#include "tests/lab/listener.hpp"

namespace posed::lab {

struct Replug {
  Moment unplugged, plugged;
  Moment node;  // when the kernel made the device's node
};

struct Verdict {
  std::uint64_t samples = 0;
  std::uint64_t mixed = 0;          // raw values of more than one report, or of none
  std::uint64_t skipped = 0;        // holes within a session
  std::uint64_t gaps = 0;           // in the stream's own numbers
  std::uint64_t ours = 0;           // sessions before whose first report one is missing that was
                                    // said when posed had told that it found the glove
  std::uint64_t cut_early = 0;      // sessions whose end misses more than what was under way
  std::uint64_t lost_a_replug = 0;  // reports, at most
  std::chrono::steady_clock::duration back{};        // node to the client's first sample, at most
  std::chrono::steady_clock::duration since_plug{};  // plug to the same
  std::chrono::steady_clock::duration silence{};     // the longest between two samples of a session
  std::string trouble;

  [[nodiscard]] bool good() const;
  [[nodiscard]] std::string text() const;
};

// `said[n]` is when report n was offered, `modulus` what its number was taken by.
Verdict judge(const Heard& heard, const std::vector<Moment>& said, std::uint32_t modulus,
              const std::vector<Replug>& replugs);

}  // namespace posed::lab
