// MergedStats: the stats of several daemons as those of one, so that `posed top` and `posed
// monitor` see all streams of a relay. Cold.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "posed/v1/posed.pb.h"

namespace posed::relay {

class MergedStats {
 public:
  explicit MergedStats(std::size_t upstreams) : heard_(upstreams) {}

  // Stats came from an upstream. Returns what to publish: of one upstream its own bytes; of several
  // the streams and sources of all that are not silent, each stream with the clock of its own
  // machine, and everything else as the first of them says it, whenever that one sends its stats.
  // Empty: nothing now. `sound` is false for bytes that are no stats.
  [[nodiscard]] std::optional<std::string> take(std::size_t upstream, std::string_view bytes,
                                                std::int64_t now_ns, bool& sound);

 private:
  struct Heard {
    v1::Stats stats{};
    std::int64_t at_ns = 0;
    bool ever = false;
  };
  std::vector<Heard> heard_;  // [upstream]
};

}  // namespace posed::relay
