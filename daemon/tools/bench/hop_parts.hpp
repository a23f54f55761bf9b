// Where the time between the arrival of a pose and its receipt by a subscriber goes: the parts of
// the way, and the daemon's threads (daemon/HOP.md). Cold.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "daemon/tools/bench/hop_report.hpp"
#include "daemon/tools/bench/hop_subscriber.hpp"
#include "daemon/tools/bench/thread_times.hpp"
#include "daemon/tools/report/bench_sections.hpp"

namespace posed::tools {

// What the threads did for each frame.
struct ThreadShare {
  std::string name;
  double ran_us = 0.0, waited_us = 0.0;  // on a core; ready, but without one
  double turns = 0.0;                    // how often it was put on a core
};

struct HopParts {
  HopFigures decode;     // in the reader, from its arrival stamp on
  HopFigures stages;     // in the pipeline
  HopFigures hand_over;  // from one thread to the next, twice, and the publisher's encoding
  HopFigures socket;     // from the publisher through ZeroMQ to the subscriber
  std::vector<ThreadShare> threads;

  // What one thread fewer would save of the median at most: one of the two hand-overs.
  [[nodiscard]] double one_thread_fewer_us() const { return hand_over.p50_us / 2.0; }
};

// Of the poses that arrived in [start_ns, end_ns); `times`: of the daemon's threads meanwhile.
[[nodiscard]] HopParts hop_parts(std::span<const Arrival> arrivals, std::int64_t start_ns,
                                 std::int64_t end_ns, const TimesByThread& times);

[[nodiscard]] nlohmann::ordered_json to_json(const HopParts& parts);
void print(const HopParts& parts);
// `bare_us`: the median of a bare hop, whose length the socket's part would have alone.
[[nodiscard]] std::vector<report::Figure> figures_of(const HopParts& parts, double bare_us);

}  // namespace posed::tools
